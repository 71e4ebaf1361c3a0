"""How often the 95 % intervals of `cosim calibrate` hold the true value: of results folders of this package, and of
noise that is not white.

``python docs/studies/calibrated_intervals.py`` prints the tables of docs/reference/identification.md, with ``--write``
it puts them there; that takes five minutes of one core.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import scipy
from page_tables import write_table

import fmus
from cosim import Scenario
from cosim.calibration.fitting import Calibration, calibrate
from cosim.calibration.fmu_runs import FmuRuns
from cosim.calibration.recorded_signals import RecordedSignals, Selection, sort_columns
from cosim.calibration.running_resistance import RunningResistance
from cosim.calibration.runs import Runs
from cosim.results.load_result import load_result
from plant_models import PLANTS

PAGE = Path(__file__).parents[1] / "reference" / "identification.md"
RUNS = 200
DAVIS = ("davis_a", "davis_b", "davis_c")
KNOWN = {"traction_coefficient": 1.0, "brake_coefficient": 1.0, "internal_step": 0.1}
STOP = 120.0  # [s]

Array = np.ndarray


@dataclass(frozen=True)
class Journey:
    """A train that is driven by a speed controller: it accelerates, keeps a speed and brakes.

    Args:
        truth: mass and Davis coefficients. start: speed at the begin [m/s]. noise: of the measured speed [m/s].
        step: communication step and sampling [s]. algorithm: of the master. speeds: of the profile [m/s], shape (6,).
    """

    truth: Mapping[str, float]
    start: float
    noise: float
    step: float
    algorithm: str
    speeds: Sequence[float]

    @classmethod
    def drawn(cls, number: int) -> Journey:
        """One of many, which differ in all that a journey has; w2 has either sign.

        Args:
            number: of it.
        """
        rng = np.random.default_rng([2026, number])
        mass = rng.uniform(20e3, 200e3)
        parts = rng.uniform([0.01, 0.0, -1e-4], [0.05, 2e-3, 2e-4])
        top, low = rng.uniform(22.0, 40.0), rng.uniform(8.0, 15.0)
        return cls(
            {"mass": mass} | {name: mass * part for name, part in zip(DAVIS, parts.tolist(), strict=True)},
            rng.uniform(8.0, 15.0),
            10.0 ** rng.uniform(-2.0, -1.0),
            float(rng.choice([0.2, 0.5, 1.0])),
            str(rng.choice(["gauss-seidel", "jacobi"])),
            [low, top, top, low, top, low],
        )

    def record(self, folder: Path) -> None:
        """Run it, and write its results folder.

        Args:
            folder: that is written.
        """
        scenario = Scenario(stop=STOP, step=self.step, master={"algorithm": self.algorithm})
        known = {**KNOWN, **self.truth, "train_speed": self.start}
        scenario.add("train", model="longitudinal_train", parameters=known)
        mass = self.truth["mass"]
        gains = {"proportional_gain": 0.25 * mass, "integral_gain": 6e-3 * mass, "effort_lag": 1.0}
        times = [0.0, 40.0, 55.0, 75.0, 95.0, STOP, STOP + 1.0, STOP + 2.0]
        profile = {"profile_time": times, "profile_speed": [*self.speeds, self.speeds[-1], self.speeds[-1]]}
        scenario.add("driver", model="driver", parameters=gains | profile)
        scenario.connect("driver.effort -> train.effort", "train.speed -> driver.odometer")
        outcome = scenario.run(warn=lambda _text: None)
        if outcome.failure is not None:
            raise RuntimeError(outcome.failure)
        outcome.write(folder, report=False)


def errors(number: int, path: str) -> dict[tuple[str, str], float]:
    """Of one journey the error of each parameter over half of its interval, by model and parameter.

    Args:
        number: of the journey. path: of the FMU of the train.
    """
    journey = Journey.drawn(number)
    with TemporaryDirectory() as folder:
        journey.record(Path(folder) / "run")
        result = load_result(Path(folder) / "run")
    noise = journey.noise * np.random.default_rng([2027, number]).standard_normal(len(result.time))
    result.table["train.speed"] += noise
    guesses = {name: 0.8 * value for name, value in journey.truth.items()}
    sealed = FmuRuns(path, list(guesses), fixed=KNOWN | {"train_speed": journey.start}, guesses=guesses)
    models: Mapping[str, Runs] = {
        "running_resistance": RunningResistance(mass=journey.truth["mass"]),
        "longitudinal_train": sealed,
    }
    found = {name: calibrate(runs, _columns(result, runs)) for name, runs in models.items()}
    sealed.close()
    return {
        (model, name): abs(one.values[name] - journey.truth[name]) / (0.5 * (high - low))
        for model, one in found.items()
        for name, (low, high) in one.intervals.items()
        if name in journey.truth
    }


def _columns(result: object, runs: Runs) -> RecordedSignals:
    units = {name: runs.unit(name) for name in runs.outputs}
    return sort_columns(result, "run", units, runs.inputs, Selection(["speed=train.speed"]))  # type: ignore[arg-type]


def coverage(numbers: Sequence[int]) -> dict[tuple[str, str], float]:
    """Shares of journeys whose intervals hold the true value, by model and parameter.

    Args:
        numbers: of the journeys.
    """
    path = str(fmus.cached_fmu(PLANTS["longitudinal_train"](), fmi_version=2))
    found = [errors(number, path) for number in numbers]
    return {key: float(np.mean([one[key] < 1.0 for one in found])) for key in found[0]}


def _filtered(numerator: Sequence[float], denominator: Sequence[float]) -> Callable[[Array], Array]:
    return lambda white: np.asarray(scipy.signal.lfilter(numerator, denominator, white))


NOISES: Mapping[str, Callable[[Array], Array]] = {
    "white": _filtered([1.0], [1.0]),
    "first order, r = 0.3": _filtered([1.0], [1.0, -0.3]),
    "first order, r = 0.6": _filtered([1.0], [1.0, -0.6]),
    "first order, r = 0.9": _filtered([1.0], [1.0, -0.9]),
    "means of 5 samples": _filtered([0.2] * 5, [1.0]),
    "white, and 1/5 with r = 0.95": lambda white: white + 0.5 * _filtered([0.312], [1.0, -0.95])(white[::-1]),
    "differences, r = -0.5": _filtered([1.0, -1.0], [1.0]),
}
"""Of white noise, noise of another kind."""
TRUE = {"davis_a": 0.46, "davis_b": 5.7e-3, "davis_c": -2.4e-4, "initial_speed": 5.5}
EFFORT, NOISE = 1.2, 0.02  # by mass [m/s2], [m/s]


def accelerated(number: int, count: int, kind: str) -> Calibration:
    """An acceleration of 50 s with noise of a kind, calibrated.

    Args:
        number: of the noise. count: samples. kind: of the noise, one of `NOISES`.
    """
    time = np.linspace(0.0, 50.0, count)
    model, inputs = RunningResistance(mass=1.0), {"effort": np.full(count, EFFORT)}
    exact = model.run(TRUE, RecordedSignals(time, {}, inputs))[0]
    noise = NOISES[kind](np.random.default_rng([2028, number]).standard_normal(count + 200))[200:]
    return calibrate(model, RecordedSignals(time, {"speed": exact + NOISE * noise}, inputs))


def error_rates(kind: str, count: int, runs: int) -> tuple[float, float]:
    """Shares of runs that are said to have noise that is not white, and of intervals that hold the true value.

    Args:
        kind: of the noise. count: samples. runs: how many.
    """
    found = [accelerated(number, count, kind) for number in range(runs)]
    said = np.mean([any("no white noise" in remark for remark in one.remarks) for one in found])
    inside = [low < TRUE[name] < high for one in found for name, (low, high) in one.intervals.items() if name in DAVIS]
    return float(said), float(np.mean(inside))


def tables() -> dict[str, str]:
    """Both tables, by their names in the page."""
    shares = coverage(range(RUNS))
    lines = ["| model | parameter | intervals that hold |", "|---|---|---|"]
    lines += [f"| `{model}` | `{name}` | {100.0 * share:.1f} % |" for (model, name), share in shares.items()]
    rates = ["| noise | samples | said to be not white | intervals that hold |", "|---|---|---|---|"]
    for kind in NOISES:
        for count in (200, 800):
            said, inside = error_rates(kind, count, RUNS)
            rates.append(f"| {kind} | {count} | {100.0 * said:.1f} % | {100.0 * inside:.1f} % |")
    return {"intervals": "\n".join(lines), "noises": "\n".join(rates)}


def main() -> None:
    """Print the tables, or put them into the page."""
    found = tables()
    print("\n\n".join(found.values()))
    if "--write" in sys.argv:
        for name, text in found.items():
            write_table(PAGE, name, text)


if __name__ == "__main__":
    main()
