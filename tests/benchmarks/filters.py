"""Benchmark: native Kalman filters of a synchronous motor (4 states, 2 measurements) beside those of filterpy, filters
of 20 members of it, both over its sealed FMU too, and the filter of odometer and balises.

``python tests/benchmarks/filters.py [SAMPLES]``. Those of the motor take one Runge-Kutta step a period, on the same
equations; filterpy has no particle filter, so that one stands beside its ensemble, and of the train it computes the
matrices only. Nothing is asserted. Times are CPU seconds of this process.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from typing import Any

import filterpy.kalman
import numpy as np
from cpu_time import seconds

from cosim.fmu_filter.component import FmuFilterModel
from cosim.fmu_filter.settings import FilterTable
from fmu_observer.observers.generic.discrete.ensemble_kalman_filter import EnsembleKalmanFilter
from fmu_observer.observers.generic.discrete.extended_kalman_filter import ExtendedKalmanFilter
from fmu_observer.observers.generic.discrete.particle_filter import ParticleFilter
from fmu_observer.observers.generic.discrete.unscented_kalman_filter import UnscentedKalmanFilter
from fmu_observer.observers.train.balise_odometer_ekf import ODOMETER_ROW, BaliseOdometerEkf
from fmu_observer.observers.train.balise_odometer_transition import transition
from fmus import Batch, cached_fmu
from plant_models import PLANTS
from plant_models.hybrid import HybridSystem

MEMBERS = 200
DRAWN = 20  # members of an ensemble, or particles
MOTOR: dict[str, Any] = {"model": "synchronous_motor", "outputs": ["current_d", "current_q"], "substeps": 1}
T = PLANTS["synchronous_motor"]().internal_step
DRIVEN = {"sample_period": T, "voltage_d": 1.0}
R, L, FLUX, J, FRICTION, POLES = 3.4, 0.0121, 0.013, 5.9e-6, 1e-4, 2.0
H = np.eye(2, 4)


def main(arguments: list[str]) -> None:
    samples = int((*arguments, "1000")[0])
    theirs = {"extended": by_filterpy(extended(), samples), "unscented": by_filterpy(unscented(), samples)}
    for kind, other in ((ExtendedKalmanFilter, "extended"), (UnscentedKalmanFilter, "unscented")):
        print(f"{other} filter of filterpy: {1e6 * theirs[other]:.1f} us a sample", flush=True)
        for form in kind.forms:
            own = native(kind(form=form, **MOTOR), samples)
            print(
                f"  {kind.name}, {form}: {1e6 * own:.3f} us a sample, {theirs[other] / own:.0f} times faster",
                flush=True,
            )
    theirs["ensemble"] = by_filterpy(ensemble(), max(10, samples // 10))
    print(f"ensemble filter of filterpy, {DRAWN} members: {1e6 * theirs['ensemble']:.1f} us a sample", flush=True)
    for drawn in (EnsembleKalmanFilter, ParticleFilter):
        own = native(drawn(members=DRAWN, **MOTOR), max(10, samples // 10))
        print(f"  {drawn.name}: {1e6 * own:.3f} us a sample, {theirs['ensemble'] / own:.0f} times faster", flush=True)
    theirs["particle"] = theirs["ensemble"]
    for name, other in {"ekf": "extended", "ukf": "unscented", "ensemble": "ensemble", "particle": "particle"}.items():
        own = over_fmu(name, max(10, samples // 10))
        print(
            f"{name} over the sealed FMU: {1e6 * own:.1f} us a sample, {own / theirs[other]:.2f} times filterpy's",
            flush=True,
        )
    theirs["train"] = by_filterpy(train(), samples)
    print(f"the matrices of {BaliseOdometerEkf.name} by filterpy: {1e6 * theirs['train']:.1f} us a reading", flush=True)
    own = native(BaliseOdometerEkf(), samples, {"effort": 2e4, "odometer": 20.0}, period=0.1)
    print(
        f"  {BaliseOdometerEkf.name}, flow and gates too: {1e6 * own:.3f} us, {theirs['train'] / own:.0f} times faster",
        flush=True,
    )


def native(system: HybridSystem, samples: int, values: Mapping[str, float] = DRIVEN, period: float = T) -> float:
    """CPU seconds of a sample in the C of the FMU, with its integration loop and events."""
    batch = Batch(system, MEMBERS)
    for name, value in values.items():
        batch.set(name, value)
    batch.start()
    spent = seconds(lambda: batch.run([samples * period]))
    assert not batch.failures
    return spent / (samples * MEMBERS)


def over_fmu(kind: str, samples: int) -> float:
    """CPU seconds of a sample of a filter that moves the FMU by its calls, and has it started anew at each."""
    motor, driven = PLANTS["synchronous_motor"](), {"voltage_d": 1.0, "voltage_q": 0.0, "load_torque": 0.0}
    states = [signal.name for signal in motor.states]
    settings: dict[str, Any] = {
        "kind": kind,
        "measurements": dict.fromkeys(MOTOR["outputs"], 0.3),
        "members": DRAWN,
        "sample_period": T,
    }
    if kind == "particle":
        settings["input_noise"] = {"voltage_d": 1.0}
    else:
        settings |= {"process_noise": dict.fromkeys(states, 0.03), "start_deviation": dict.fromkeys(states, 1.0)}
    filter_ = FmuFilterModel(cached_fmu(motor, fmi_version=3), FilterTable.model_validate(settings), {"voltage_d": 1.0})
    readings = np.random.default_rng(0).normal(size=(samples, 2))

    def run() -> None:
        for k, (d, q) in enumerate(readings):
            filter_.step(k * T, {**driven, "measured_current_d": d, "measured_current_q": q}, T)

    return seconds(run) / samples


def by_filterpy(step: Callable[[np.ndarray], None], samples: int) -> float:
    """CPU seconds of a sample."""
    readings = np.random.default_rng(0).normal(size=(samples, 2))

    def run() -> None:
        for reading in readings:
            step(reading)

    return seconds(run) / samples


def flow(x: np.ndarray) -> np.ndarray:
    speed = POLES * x[2]
    return np.array(
        [
            (1.0 - R * x[0]) / L + speed * x[1],
            -R / L * x[1] - speed * x[0] - FLUX / L * speed,
            (1.5 * POLES * FLUX * x[1] - FRICTION * x[2]) / J,
            speed,
        ]
    )


def moved(x: np.ndarray, dt: float = T) -> np.ndarray:
    a = flow(x)
    b = flow(x + 0.5 * dt * a)
    c = flow(x + 0.5 * dt * b)
    d = flow(x + dt * c)
    return np.asarray(x + dt / 6.0 * (a + 2.0 * b + 2.0 * c + d))


def extended() -> Callable[[np.ndarray], None]:
    theirs = filterpy.kalman.ExtendedKalmanFilter(4, 2)
    theirs.Q, theirs.R = 1e-3 * np.eye(4), 0.1 * np.eye(2)

    def step(reading: np.ndarray) -> None:
        x = theirs.x[:, 0]
        A = np.array(
            [
                [-R / L, POLES * x[2], POLES * x[1], 0.0],
                [-POLES * x[2], -R / L, -POLES * (x[0] + FLUX / L), 0.0],
                [0.0, 1.5 * POLES * FLUX / J, -FRICTION / J, 0.0],
                [0.0, 0.0, POLES, 0.0],
            ]
        )
        theirs.F = np.eye(4) + T * A
        theirs.x = moved(x)[:, None]
        theirs.P = theirs.F @ theirs.P @ theirs.F.T + theirs.Q
        theirs.update(reading[:, None], lambda _x: H, lambda x: H @ x)

    return step


def _stepped(theirs: Any) -> Callable[[np.ndarray], None]:
    theirs.Q, theirs.R = 1e-3 * np.eye(4), 0.1 * np.eye(2)

    def step(reading: np.ndarray) -> None:
        theirs.predict()
        theirs.update(reading)

    return step


def unscented() -> Callable[[np.ndarray], None]:
    points = filterpy.kalman.MerweScaledSigmaPoints(4, 0.1, 2.0, 0.0)
    theirs = filterpy.kalman.UnscentedKalmanFilter(4, 2, T, lambda x: x[:2], moved, points)
    return _stepped(theirs)


def ensemble() -> Callable[[np.ndarray], None]:
    theirs = filterpy.kalman.EnsembleKalmanFilter(np.zeros(4), np.eye(4), 2, T, DRAWN, lambda x: x[:2], moved)
    return _stepped(theirs)


def train() -> Callable[[np.ndarray], None]:
    theirs, p = (
        filterpy.kalman.KalmanFilter(4, 1),
        BaliseOdometerEkf().unpack_parameters(BaliseOdometerEkf().start_parameters()),
    )
    theirs.H, theirs.R = ODOMETER_ROW, np.array([[p.odometer_deviation**2]])
    theirs.F, theirs.Q = transition(0.1, 20.0, 2e4, p)

    def step(reading: np.ndarray) -> None:
        theirs.predict()
        theirs.update(reading[:1])

    return step


if __name__ == "__main__":
    main(sys.argv[1:])
