"""The train's internal step against SciPy's Radau at 1e-9 on the same equations.

The bounds are two to three times what was measured at the default step of 1 ms on the worse of the two curves. Runs
that start, stop, lock or meet free play contain steps of first order; the others are of second order.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from train_runs import followed, reference, start

from plant_models.railway.vehicle.train import Train

ZONE = {"zone_from[1]": 5.0, "zone_to[1]": 40.0}
WET = {"zone_from[1]": -100.0, "zone_to[1]": 1e6}
# name: (phases [(end s, (effort N, brake demand))], start speed m/s, parameters, bounds on position m, elongation m,
# speeds m/s, wheel speeds m/s)
RUNS: dict[str, Any] = {
    "traction": ([(3.0, (60e3, 0.0))], 5.0, {}, (4e-7, 8e-7, 9e-6, 3e-6)),
    "from rest": ([(3.0, (83e3, 0.0))], 0.0, {}, (1.5e-3, 5e-5, 1e-3, 7e-4)),
    "zone": ([(3.0, (60e3, 0.0))], 2.0, ZONE, (4e-7, 8e-7, 9e-6, 3e-6)),
    "electric brake to a stop": ([(9.0, (-83e3, 0.0))], 4.0, {}, (6e-7, 1e-4, 1.3e-3, 4e-6)),
    "indirect brake to a stop": ([(8.0, (0.0, 1.0))], 4.0, {}, (2.4e-6, 8e-7, 1.2e-6, 3e-6)),
    "lock and release": ([(2.0, (-250e3, 0.0)), (4.0, (0.0, 0.0))], 10.0, WET, (2.5e-4, 6e-6, 1.2e-4, 3e-3)),
    "free play": ([(3.0, (60e3, 0.0))], 5.0, {"coupler_free_play": 0.03}, (3e-5, 3e-4, 4e-3, 5e-4)),
    "brake on a hill": ([(8.0, (-30e3, 0.0))], 2.0, {"gradient[1]": 0.008}, (2e-7, 5e-5, 7e-4, 1.3e-6)),
}


def _errors(train: Train, run: str, step: float) -> np.ndarray:
    phases, speed, changes, _ = RUNS[run]
    times = np.round(np.arange(0.0, phases[-1][0] + 1e-9, 0.01), 10)
    return _worst(train, start(train, speed), phases, times, step, changes)


def _worst(train: Train, x0: np.ndarray, phases: list, times: np.ndarray, step: float, changes: dict) -> np.ndarray:
    truth = reference(train, x0, phases, times, **changes)
    found = followed(train, x0, phases, times, internal_step=step, **changes)
    worst = np.abs(found - truth).max(axis=0)
    return np.array([worst[0], worst[1:3].max(), worst[3:6].max(), 0.575 * worst[6:10].max()])


@pytest.mark.parametrize("run", RUNS)
def test_the_default_step_is_accurate(run: str) -> None:
    train = Train(wagons=2, zone_count=1, adhesion="polach" if run == "from rest" else "burckhardt")
    errors = _errors(train, run, train.internal_step)
    assert (errors < RUNS[run][3]).all(), errors


def test_halving_the_step_quarters_the_error_of_a_ringing_train() -> None:
    """Elongations explicit, speeds and wheels implicit: of order 2 all together."""
    train, times = Train(wagons=2, zone_count=1), np.round(np.arange(0.0, 2.0001, 0.02), 10)
    x0, phases = start(train, 15.0, **{"elongation[1]": 0.01, "elongation[2]": -0.005}), [(2.0, (0.0, 0.0))]
    coarse, fine = (_worst(train, x0, phases, times, h, {}) for h in (2e-3, 1e-3))
    assert np.log2(coarse / fine) == pytest.approx([2.0] * 4, abs=0.05)
