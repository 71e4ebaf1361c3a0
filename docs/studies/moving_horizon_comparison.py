"""Moving-horizon observers beside filters, continuous-discrete observers and a factor graph of others, on one recorded
run.

``python docs/studies/moving_horizon_comparison.py`` prints the table of docs/theses/moving_horizon.md, with ``--write``
it puts it there; that takes some three minutes. The train runs Amsterdam - Utrecht with its jams, skids and wet
stretches; to that come balises that do not lie where the map says, and false telegrams.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from page_tables import write_table

from cosim import Outcome, Scenario
from cosim.choice.benchmark import benchmark_observers
from cosim.evaluation.balise_gaps import gap_errors, largest, root_mean_square
from fmu_observer.formulas.filtering.square_root import factor
from fmu_observer.formulas.moving_horizon.real_time_iteration import WINDOW_MEMORY, WINDOW_OUTPUTS, Iterated
from fmu_observer.formulas.moving_horizon.robust_loss import SCALES
from fmu_observer.models.filter_models import FilterModel, Known
from fmu_observer.observers.full_convergence import FullBaliseMovingHorizon
from fmu_observer.observers.generic.discrete.unscented_kalman_filter import UnscentedKalmanFilter
from fmu_observer.observers.train.balise_moving_horizon import LAYOUT, BaliseMovingHorizon, _moved, _seen
from fmu_observer.observers.train.balise_odometer_ekf import TUNABLE
from fmu_observer.observers.train.balise_odometer_transition import ORDER
from fmus.tables.numbers import error_number, number
from plant_models.hybrid import input_signal, state, vector

try:
    import gtsam
except ImportError:  # extra `benchmark`
    gtsam = None

PAGE = Path(__file__).parents[1] / "theses" / "moving_horizon.md"
WINDOW = 80  # rows: 40 s, more than the longest gap lasts
PERIOD = 0.5  # [s] between two readings, for all filters
MAP_DEVIATION, ACCURACY = 2.5, 5.0  # [m] by which balises lie beside the map; told location accuracy
TINY = 1e-9  # variance that GTSAM gets more of every transition: it needs some, also of one that takes no time
FALSE = ((122.0, 60.0), (260.0, -45.0), (405.0, 150.0), (612.0, 35.0), (700.0, -400.0))  # [s], [m]
TRAIN = {"mass": 873e3, "davis_a": 4320.0, "davis_b": 160.0, "davis_c": 9.6}
START = {"estimated_position": 3100.0, "estimated_speed": 27.778}
NOISES = {s.name: s.start for s in TUNABLE} | {"balise_deviation": MAP_DEVIATION}
FILTER = {**TRAIN, **START, **NOISES, "odometer_period": PERIOD}
TYPICAL_SPEED = 30.0  # [m/s] at which the unscented filter takes the creep's deviation
UNSCENTED_STATES = (
    ("position", "m", 3100.0), ("speed", "m/s", 27.778), ("disturbance", "m/s2", 0.0), ("creep", "m/s", 0.0),
)  # fmt: skip
LIMITS = {"speed_limit": 42.0, "disturbance_limit": 0.2}
HEADING = (
    "", "position, rms [m]", "before balises, rms [m]", "before balises, largest [m]", "speed, rms [m/s]",
    "outside the bounds [% of the rows]", "cost [us a step]",
)  # fmt: skip
OTHERS = ("continuous_discrete_observer", "takagi_sugeno_cdo", "multirate_cdo", "discrete_uio", "odometer_reset")


class FactorGraphSmoother(BaliseMovingHorizon):
    """The rows of `balise_moving_horizon` in GTSAM's fixed-lag smoother: same transitions, noises and loss.

    It has no bounds, judges the newest row like all others, and its marginals stand in the place of the arrival cost.
    Not pure: the graph stays in the object, for one run.
    """

    name = "factor_graph_smoother"
    traceable = False
    internal_step = 0.1

    def __init__(self, lag: float = WINDOW * PERIOD) -> None:
        super().__init__(window=1, loss="geman_mcclure")
        self.options = {"lag": lag}
        search = gtsam.LevenbergMarquardtParams()
        search.setLinearSolverType("MULTIFRONTAL_QR")
        self._smoother = gtsam.BatchFixedLagSmoother(lag, search)
        self._count = 0

    def iterate(self, problem: Any, passes: int, *arrays: Any) -> Iterated:  # type: ignore[override]
        """A row more in the graph."""
        arrival, _, points, row_flat, point, shared = (np.asarray(a, dtype=float) for a in arrays)
        row, graph, values = LAYOUT.unpacked(row_flat), gtsam.NonlinearFactorGraph(), gtsam.Values()
        stamps, key = {self._count + 1: float(row.time)}, self._count + 1
        if self._count == 0:  # the first reading comes at once: the arrival cost is its own prior
            prior = gtsam.noiseModel.Gaussian.Covariance(arrival[2 * ORDER :].reshape(ORDER, ORDER))
            graph.add(gtsam.PriorFactorVector(key, arrival[ORDER : 2 * ORDER], prior))
        else:
            graph.add(_transition(key, row, points[-ORDER:], shared))
        seen = _seen(point, row, shared)
        robust = gtsam.noiseModel.Robust.Create(
            gtsam.noiseModel.mEstimator.GemanMcClure.Create(SCALES[self.loss]),
            gtsam.noiseModel.Isotropic.Sigma(1, float(np.sqrt(seen.noise[0, 0]))),
        )
        graph.add(gtsam.CustomFactor(robust, [key], _residual(np.asarray(seen.H), float(row.measured[0]))))
        values.insert(key, point)
        self._smoother.update(graph, values, stamps)
        self._count = key
        estimate = np.asarray(self._smoother.calculateEstimate().atVector(key))
        last = np.array([float(name == "rows_in_window") for name in WINDOW_OUTPUTS])
        remembered = dict(zip(WINDOW_MEMORY, (arrival, row_flat, estimate, last), strict=True))
        return Iterated(estimate, arrival[2 * ORDER :], remembered)


def _transition(key: int, row: Any, before: np.ndarray, shared: np.ndarray) -> Any:
    moved = _moved(before, row, shared)
    whitened = np.linalg.inv(np.asarray(factor(moved.noise + TINY * np.eye(ORDER))))
    offset = whitened @ row.inputs[:ORDER]
    linear = gtsam.JacobianFactor(
        key - 1, -whitened @ moved.F, key, whitened, offset, gtsam.noiseModel.Unit.Create(ORDER)
    )
    zero = gtsam.Values()  # where it was linearised: without that point GTSAM takes it for a factor of the step
    for one in (key - 1, key):
        zero.insert(one, np.zeros(ORDER))
    return gtsam.LinearContainerFactor(linear, zero)


def _residual(H: np.ndarray, measured: float) -> Callable[..., np.ndarray]:
    def residual(this: Any, values: Any, jacobians: list[np.ndarray] | None) -> np.ndarray:
        if jacobians is not None:
            jacobians[0] = H
        return H @ values.atVector(this.keys()[0]) - measured

    return residual


def unscented() -> UnscentedKalmanFilter:
    """The unscented filter of the same train; the creep's deviation as at 30 m/s, since its noise knows no state."""
    p = {**TRAIN, **NOISES}

    def moved(x: Any, _w: Any, known: Known, period: Any) -> Any:
        drag = p["davis_b"] * x[1] + p["davis_c"] * x[1] * np.abs(x[1])
        effort = known.u[0] - p["davis_a"] * np.where(x[1] > 0.1, 1.0, 0.0)
        rate = (effort - drag) / p["mass"] + x[2]
        fade = np.exp(-period / p["creep_time"])
        return vector(x[0] + period * x[1] + 0.5 * period**2 * rate, x[1] + period * rate, x[2], fade * x[3])

    model = FilterModel(
        name="train_with_creep",
        description="Train as of balise_odometer_ekf",
        source="ours",
        states=tuple(state(name, unit, start, name) for name, unit, start in UNSCENTED_STATES),
        inputs=(input_signal("effort", "N", 0.0, "Effort"),),
        measurements=(
            input_signal("position", "m", 0.0, "Balise"),
            input_signal("odometer", "m/s", 0.0, "Reading"),
        ),
        moved=moved,
        measured=lambda x, _v, _known: vector(x[0], x[1] + x[3]),
        sample_period=PERIOD,
    )
    return UnscentedKalmanFilter(model, arrival=["balise", "periodic"])


def scenario() -> Scenario:
    """Amsterdam - Utrecht with map errors and false telegrams, and all who take part."""
    chosen = Scenario.load("amsterdam_utrecht")
    chosen.set("certificates", "ignore")
    chosen.set("balises.location_accuracy", ACCURACY)
    chosen.set("balises.position_noise", MAP_DEVIATION / ACCURACY)
    chosen.set("balises.false_telegrams", [{"time": time, "offset": offset} for time, offset in FALSE])
    return chosen


def add_filters(chosen: Scenario) -> dict[str, str]:
    """Filters, windows and the factor graph beside the train; labels by name."""
    density = np.diag([0.0, NOISES["acceleration_density"], NOISES["disturbance_density"], 0.0])
    creep = NOISES["creep_share"] * TYPICAL_SPEED
    density[3, 3] = 2.0 * creep**2 / NOISES["creep_time"]
    read = np.diag([MAP_DEVIATION**2, NOISES["odometer_deviation"] ** 2])
    sigma = {"sample_period": PERIOD, "process_density": density.ravel().tolist()}
    sigma["measurement_covariance"] = read.ravel().tolist()
    window = {"window": WINDOW, "loss": "geman_mcclure"}
    own: dict[str, tuple[str, dict[str, Any]]] = {
        "ekf": ("EKF", {"observer": "balise_odometer_ekf", "parameters": FILTER}),
        "ukf": ("UKF", {"observer": unscented(), "parameters": sigma}),
        "rti": (
            f"MHE, {WINDOW} rows, 2 passes",
            {
                "observer": "balise_moving_horizon",
                "options": {**window, "passes": 2},
                "parameters": {**FILTER, **LIMITS},
            },
        ),
        "full": (
            f"MHE, {WINDOW} rows, to convergence",
            {"observer": FullBaliseMovingHorizon, "options": window, "parameters": {**FILTER, **LIMITS}},
        ),
    }
    if gtsam is not None:
        own["graph"] = (
            f"GTSAM, fixed lag of {WINDOW * PERIOD:g} s",
            {"observer": FactorGraphSmoother, "parameters": FILTER},
        )
    for name, (label, stated) in own.items():
        chosen.add(name, label=label, **stated)
        odometer = "measured_odometer" if name == "ukf" else "odometer"
        chosen.connect(f"driver.effort -> {name}.effort", f"odometer.reading -> {name}.{odometer}")
    return {name: label for name, (label, _) in own.items()}


def compared(chosen: Scenario, recorded: str | None = None) -> str:
    """The table of all who take part, on one recorded run.

    Args:
        chosen: with the train. recorded: folder of an earlier recording.
    """
    labels = add_filters(chosen)
    labels |= {name: str(chosen.table().components[name].label) for name in OTHERS}
    benchmark = benchmark_observers(chosen, list(labels), recorded=recorded)
    lines = [HEADING, ["---"] * len(HEADING)]
    for score in benchmark.scores:
        if score.failure is not None or score.whole is None:  # what there is of numbers is of no use
            lines.append([labels[score.name], "diverged" if score.failure else "-", *["-"] * (len(HEADING) - 2)])
            continue
        outcome = benchmark.outcomes[score.name]
        ends = gap_errors(outcome.result, outcome.spec).errors[score.name]
        position, speed = score.whole.position, score.whole.speed
        assert position is not None
        assert speed is not None
        sizes = (position.rms, root_mean_square(ends), largest(ends), speed.rms)
        outside = number(violations(outcome, score.name))
        lines.append([labels[score.name], *map(error_number, sizes), outside, number(score.cost or 0.0)])
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def violations(outcome: Outcome, name: str) -> float:
    """Share of the rows in which an estimate is outside of the bounds that the windows keep [%].

    Args:
        outcome: of the run. name: of the observer.
    """
    columns = outcome.result.table.dtype.names
    speed = np.asarray(outcome[f"{name}.speed"])
    outside = (speed < 0.0) | (speed > LIMITS["speed_limit"])
    if f"{name}.disturbance" in columns:
        outside |= np.abs(np.asarray(outcome[f"{name}.disturbance"])) > LIMITS["disturbance_limit"] * (1.0 + 1e-9)
    return 100.0 * float(outside.mean())


def main() -> None:
    """Print the table, or write it into the page."""
    text = compared(scenario(), sys.argv[-1] if len(sys.argv) > 1 and Path(sys.argv[-1]).is_dir() else None)
    print(text)
    if "--write" in sys.argv:
        write_table(PAGE, "comparison", text)


if __name__ == "__main__":
    main()
