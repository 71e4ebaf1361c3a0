"""Three planted weaknesses, and after how many runs `cosim falsify` and a search at random find them.

``python docs/studies/falsification.py`` prints the table of docs/reference/falsification.md, with ``--write`` it puts
it there; ``--searches N`` searches each so often, by default 20,
``--small N`` prints what is left of so many. The weaknesses stand in the models: an observer whose
correction of the speed grows with the gap, and is unstable beyond 60 s; a detector that latches where an alarm goes far
enough; a brake whose slide protection releases too much around one adhesion. Ranges are those of use; the scenario as
it is meets its expectation.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import numpy as np
from page_tables import print_tables

from cosim import Scenario
from cosim.falsification.falsify import falsify
from cosim.falsification.margins import expectations_of, margin_of
from cosim.runs.engine import run_jobs
from cosim.runs.executors import make_executor
from cosim.runs.run import Run
from cosim.statistics.intervals import proportion
from cosim.studies.distributions import Range, uniform
from plant_models.hybrid import HybridSystem, TriggeredEvent, input_signal, output_signal, parameter, state

PAGE = Path(__file__).parents[1] / "reference" / "falsification.md"
SEARCHES, MOST, AT_RANDOM, CHECKED = 20, 1000, 100_000, 100


class SteadyTrain(HybridSystem):
    """A train at one speed."""

    name, description, source = "steady_train", "A train at one speed", "docs/studies/falsification.py"
    states = (state("place", "m"),)
    outputs = (output_signal("position", "m"), output_signal("speed", "m/s"))
    parameters = (parameter("constant_speed", "m/s", 25.0, min=0.0),)

    def flow(self, t, x, u, p):
        return {"place": p.constant_speed}

    def output(self, t, x, u, p):
        return {"position": x.place, "speed": p.constant_speed}


class HastyObserver(HybridSystem):
    """Position and speed from balises alone; an error of the speed becomes ``1 - gain T`` of itself at each, so it
    grows where the gap T is longer than 2 / gain = 60 s.
    """

    name, description, source = "hasty_observer", "Speed from balises", "docs/studies/falsification.py"
    states = (state("place", "m"), state("rate", "m/s", 25.0))
    outputs = (output_signal("position", "m"), output_signal("speed", "m/s"))
    parameters = (parameter("gain", "1/s", 1.0 / 30.0),)
    events = (TriggeredEvent("balise", (input_signal("balise_position", "m", variability="discrete"),)),)

    def flow(self, t, x, u, p):
        return {"place": x.rate, "rate": 0.0}

    def jump(self, event, t, x, u, p):
        return {"place": u.balise_position, "rate": x.rate + p.gain * (u.balise_position - x.place)}

    def output(self, t, x, u, p):
        return {"position": x.place, "speed": x.rate}


class LatchingDetector(HybridSystem):
    """An alarm on a pulse of slip, which is gathered above a threshold and forgotten in 3 s; beyond a limit what was
    gathered is never forgotten.
    """

    name, description, source = "latching_detector", "An alarm on slip", "docs/studies/falsification.py"
    states = (state("gathered", "1"), state("latched", "1"))
    outputs = (output_signal("alarm", "1"), output_signal("slip", "1"))
    parameters = (
        parameter("slip_size", "1", 0.4, min=0.0),
        parameter("slip_length", "s", 1.0, min=0.0),
        parameter("slip_start", "s", 8.0, min=0.0),
        parameter("threshold", "1", 0.3),
    )

    def flow(self, t, x, u, p):
        slip = self._slip(t, p)
        above = np.where(slip > p.threshold, slip - p.threshold, 0.0)
        forgotten = np.where(x.latched > 0.01, 0.0, np.where(slip > p.threshold, 0.0, x.gathered / 3.0))
        return {"gathered": above - forgotten, "latched": np.where(x.gathered > 3.0, 1.0, 0.0)}

    def output(self, t, x, u, p):
        return {"alarm": np.where(x.gathered > 0.1, 1.0, 0.0), "slip": self._slip(t, p)}

    def _slip(self, t, p):
        begun = np.where(t >= p.slip_start, p.slip_size, 0.0)
        return np.where(t < p.slip_start + p.slip_length, begun, 0.0)


class NotchedBrake(HybridSystem):
    """A stop from 25 m/s: 0.45 m/s^2 is asked for, and at most what the rail gives; around an adhesion of 0.08 the
    slide protection releases half of it.
    """

    name, description, source = "notched_brake", "A stop", "docs/studies/falsification.py"
    states = (state("place", "m"), state("rate", "m/s", 25.0))
    outputs = (output_signal("position", "m"), output_signal("speed", "m/s"))
    parameters = (
        parameter("adhesion", "1", 0.15, min=0.0),
        parameter("slope", "1", 0.0),
        parameter("brake_delay", "s", 1.0, min=0.0),
        parameter("braked_share", "1", 0.9, min=0.0, max=1.0),
    )

    def flow(self, t, x, u, p):
        released = 0.5 * np.exp(-(((p.adhesion - 0.08) / 0.006) ** 2))
        given = 9.81 * p.adhesion * p.braked_share * (1.0 - released)
        braked = np.where(t < p.brake_delay, 0.0, np.minimum(0.45, given) - 9.81 * p.slope)
        return {"place": x.rate, "rate": np.where(x.rate > 0.05, -braked, -x.rate)}

    def output(self, t, x, u, p):
        return {"position": x.place, "speed": x.rate}


@dataclass(frozen=True)
class Planted:
    """A weakness: a scenario that meets its expectation as it is, the ranges of what varies, and whether settings break
    it, by hand.
    """

    scenario: Scenario
    ranges: Mapping[str, Range]
    breaks: Callable[[Mapping[str, np.ndarray]], np.ndarray]


def unstable_observer() -> Planted:
    """Gaps above 60 s: slow trains between balises that are far apart."""
    scenario = Scenario(stop=400.0, step=2.0, certificates="ignore")
    scenario.add("train", model=SteadyTrain).add("observer", observer=HastyObserver)
    scenario.balises(
        position="train.position", speed="train.speed", layout="spacing", track_end=2e4, spacing=400.0, first=100.0
    )
    scenario.expect("difference", signal="observer.position", reference="train.position", max=1000.0)
    ranges = {
        "balises.spacing": uniform(100.0, 700.0),
        "train.constant_speed": uniform(10.0, 40.0),
        "observer.rate": uniform(20.0, 30.0),
        "balises.first": uniform(10.0, 200.0),
    }
    return Planted(scenario, ranges, _observer_breaks)


def latching_detector() -> Planted:
    """Pulses that are large and long."""
    scenario = Scenario(stop=60.0, step=0.5).add("detector", model=LatchingDetector)
    scenario.expect("off", signal="detector.alarm", threshold=0.5, start=40.0)
    ranges = {
        "detector.slip_size": uniform(0.0, 1.0),
        "detector.slip_length": uniform(0.0, 4.6),
        "detector.slip_start": uniform(5.0, 20.0),
        "detector.threshold": uniform(0.3, 0.5),
    }
    return Planted(scenario, ranges, _detector_breaks)


def overshooting_stop() -> Planted:
    """Adhesions around 0.08 where the slope, a part of the brakes or their delay is adverse too."""
    scenario = Scenario(stop=120.0, step=0.5).add("train", model=NotchedBrake)
    scenario.expect("signal", signal="train.position", max=1020.0)
    ranges = {
        "train.adhesion": uniform(0.06, 0.4),
        "train.slope": uniform(-0.005, 0.005),
        "train.brake_delay": uniform(0.0, 4.0),
        "train.braked_share": uniform(0.7, 1.0),
    }
    return Planted(scenario, ranges, _stop_breaks)


PLANTED = {
    "observer unstable beyond a gap": unstable_observer,
    "detector that latches": latching_detector,
    "stop that overshoots on one adhesion": overshooting_stop,
}


def _observer_breaks(at: Mapping[str, np.ndarray]) -> np.ndarray:
    """Errors of the speed at each balise, times the gap that follows."""
    speed, gap = at["train.constant_speed"], at["balises.spacing"] / at["train.constant_speed"]
    error, left = np.abs(at["observer.rate"] - speed), np.full(len(speed), 400.0)
    length, worst = at["balises.first"] / speed, np.zeros(len(speed))
    while (left > 0.0).any():
        worst = np.where(left > 0.0, np.maximum(worst, error * np.minimum(length, left)), worst)
        error, left = error * np.abs(1.0 - length / 30.0), left - length
        length = gap
    return np.asarray(worst > 1000.0)


def _detector_breaks(at: Mapping[str, np.ndarray]) -> np.ndarray:
    """What is gathered while the slip lasts."""
    return (at["detector.slip_size"] - at["detector.threshold"]) * at["detector.slip_length"] > 3.0


def _stop_breaks(at: Mapping[str, np.ndarray]) -> np.ndarray:
    """The way from 25 m/s to rest."""
    released = 0.5 * np.exp(-(((at["train.adhesion"] - 0.08) / 0.006) ** 2))
    given = 9.81 * at["train.adhesion"] * at["train.braked_share"] * (1.0 - released)
    braked = np.minimum(0.45, given) - 9.81 * at["train.slope"]
    return 25.0 * at["train.brake_delay"] + 0.5 * 25.0**2 / braked > 1020.0


def at_random(planted: Planted, points: np.ndarray) -> dict[str, np.ndarray]:
    """Settings at points of the unit cube, shape (points,) each."""
    drawn = zip(planted.ranges.items(), points.T, strict=True)
    return {name: np.array([one.at(float(u)) for u in shares]) for (name, one), shares in drawn}


def disagreements(planted: Planted, count: int) -> int:
    """Runs at random, and as many between them and one that breaks it, of which the formula says something else."""
    random = np.random.default_rng(21)
    at = at_random(planted, random.random((20 * AT_RANDOM, len(planted.ranges))))
    broken = np.flatnonzero(planted.breaks(at))[: count // 2]
    chosen = [*range(count // 2), *broken]
    jobs = [Run(planted.scenario, {n: float(v[i]) for n, v in at.items()}, expectations_of) for i in chosen]
    said = planted.breaks(at)[chosen]
    with make_executor() as executor:
        return sum(margin_of(done.row, None).broken != said[done.number] for done in run_jobs(jobs, executor))


def row(name: str, searches: int) -> str:
    """A row of the table."""
    planted = PLANTED[name]()
    found = [falsify(planted.scenario, planted.ranges, runs=MOST, seed=n, progress=False) for n in range(searches)]
    needed = [each.first or MOST for each in found]
    points = np.random.default_rng(20).random((AT_RANDOM, len(planted.ranges)))
    share = proportion(int(planted.breaks(at_random(planted, points)).sum()), AT_RANDOM)
    chance = np.log(0.5) / np.log1p(-share.value)  # median of the geometric distribution
    broken = sum(each.broken for each in found)
    return (
        f"| {name} | {broken} of {searches} | {median(needed):g} | {min(needed)} to {max(needed)} | "
        f"{share.text(100.0)} % | {chance:.0f} | "
        f"{disagreements(planted, CHECKED)} of {CHECKED} |"
    )


def small(name: str, searches: int) -> None:
    """Print which changes are left of what some searches found."""
    planted = PLANTED[name]()
    for seed in range(searches):
        found = falsify(planted.scenario, planted.ranges, runs=MOST, seed=seed, progress=False)
        print(f"{name}: run {found.first}, left after {found.shrunk} more: {', '.join(found.smallest)}", flush=True)


def main() -> None:
    """The table."""
    if "--small" in sys.argv:
        for name in PLANTED:
            small(name, int(sys.argv[sys.argv.index("--small") + 1]))
        return
    searches = int(sys.argv[sys.argv.index("--searches") + 1]) if "--searches" in sys.argv else SEARCHES
    lines = [
        "| weakness | found | runs, median | least and most | of random runs break it | random runs, median | formula "
        "and run differ |",
        "|---" * 7 + "|",
    ]
    for name in PLANTED:
        lines.append(row(name, searches))
        print(lines[-1], flush=True)
    print_tables(PAGE, {"planted": "\n".join(lines)})


if __name__ == "__main__":
    main()
