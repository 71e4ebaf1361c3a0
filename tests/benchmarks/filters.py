"""Benchmark: native Kalman filters of a synchronous motor (4 states, 2 measurements) beside those of filterpy.

``python tests/benchmarks/filters.py [SAMPLES]``. All take one Runge-Kutta step a period, on the same equations.
Nothing is asserted. Times are CPU seconds of this process.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

import filterpy.kalman
import numpy as np

from fmu_observer.observers.discrete.extended_kalman_filter import ExtendedKalmanFilter
from fmu_observer.observers.discrete.gaussian_filter import GaussianFilter
from fmu_observer.observers.discrete.unscented_kalman_filter import UnscentedKalmanFilter
from fmus import Batch
from plant_models import PLANTS

MEMBERS = 200
MOTOR: dict[str, Any] = {"model": "synchronous_motor", "outputs": ["current_d", "current_q"], "substeps": 1}
T = PLANTS["synchronous_motor"]().internal_step
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


def native(system: GaussianFilter, samples: int) -> float:
    """CPU seconds of a sample in the C of the FMU, with its integration loop and events."""
    batch = Batch(system, MEMBERS)
    batch.set("sample_period", T)
    batch.set("voltage_d", 1.0)
    batch.start()
    spent = seconds(lambda: batch.run([samples * T]))
    assert not batch.failures
    return spent / (samples * MEMBERS)


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


def unscented() -> Callable[[np.ndarray], None]:
    points = filterpy.kalman.MerweScaledSigmaPoints(4, 0.1, 2.0, 0.0)
    theirs = filterpy.kalman.UnscentedKalmanFilter(4, 2, T, lambda x: x[:2], moved, points)
    theirs.Q, theirs.R = 1e-3 * np.eye(4), 0.1 * np.eye(2)

    def step(reading: np.ndarray) -> None:
        theirs.predict()
        theirs.update(reading)

    return step


def seconds(call: Callable[[], Any]) -> float:
    """CPU seconds of a call."""
    start = time.process_time()
    call()
    return time.process_time() - start


if __name__ == "__main__":
    main(sys.argv[1:])
