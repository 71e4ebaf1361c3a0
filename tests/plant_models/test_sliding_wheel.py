"""A wheel that slides at low speed finds its adhesion again as soon as the equations say, whatever the internal
step.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from plant_models import Locomotive
from plant_models.hybrid import Runtime, TracedSystem

RADIUS = 0.575
SETTLED = 0.3  # [s] many times the wheel's time constant, which is below 10 ms here
LOCOMOTIVE = Locomotive()


def _start(speed: float, slip: float) -> np.ndarray:
    return np.array([0.0, speed, (speed + slip * max(speed, 0.5)) / RADIUS])


def _settled(speed: float, slip: float, effort: float) -> np.ndarray:
    runtime = Runtime(LOCOMOTIVE)
    runtime.x[:], runtime.u[0] = _start(speed, slip), effort
    runtime.start(0.0)
    runtime.advance(SETTLED)
    return runtime.x.copy()


@cache
def _traced() -> TracedSystem:
    return TracedSystem(LOCOMOTIVE)


def _reference(speed: float, slip: float, effort: float) -> np.ndarray:
    """Another method, with error control, on the same equations; the train does not stop in these runs."""
    traced = _traced()
    p = LOCOMOTIVE.start_parameters()
    switches = LOCOMOTIVE.switch_vector(0.0, _start(speed, slip), np.array([effort]), p)
    signs = np.concatenate([np.ones(2), switches])

    def flow(t: float, x: np.ndarray) -> np.ndarray:
        return np.asarray(traced.derivative(t, x, np.array([effort]), p, signs)).ravel()

    solved = solve_ivp(flow, (0.0, SETTLED), _start(speed, slip), method="Radau", rtol=1e-8, atol=1e-10)
    return np.asarray(solved.y[:, -1])


@pytest.mark.parametrize("effort", [2e4, -2e4, 1e5])
@pytest.mark.parametrize("slip", [-0.2, -0.15, -0.04, 0.0, 0.04, 0.15, 0.2])
@pytest.mark.parametrize("speed", [0.7, 1.0, 1.5, 2.5])
def test_a_sliding_wheel_settles_where_radau_says(speed: float, slip: float, effort: float) -> None:
    difference = np.abs(_settled(speed, slip, effort) - _reference(speed, slip, effort))
    assert RADIUS * difference[2] < 0.01  # the way back to adhesion takes a few internal steps instead of one
    assert difference[1] < 0.01


@pytest.mark.parametrize("effort", [2e4, 1e5, 2e5, 2.6e5])
def test_a_train_starts_from_standstill_without_sliding(effort: float) -> None:
    """Up to the adhesion limit the slip follows the effort; a wheel that had been thrown over the limit would show
    it.
    """
    runtime = Runtime(LOCOMOTIVE)
    runtime.u[0] = effort
    runtime.start(0.0)
    for k in range(1, 201):
        runtime.advance(k * 0.01)
        slide = RADIUS * runtime.x[2] - runtime.x[1]
        assert slide < 0.05 * max(runtime.x[1], 0.5)
    rigid = 2.0 * (effort - 900.0) / 9e4  # the wheel's inertia takes less than a hundredth of the effort
    assert runtime.x[1] == pytest.approx(rigid, rel=0.02)
