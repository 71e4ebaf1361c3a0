"""The sliding-mode differentiators, alone and inside their observer."""

from collections.abc import Callable

import numpy as np
import pytest
from observer_runner import INERTIA, RADIUS, SteadyMotion, SystemRunner

from fmu_observer.formulas.differentiation.differentiator import (
    _signed_power,
    differentiator_flow,
    filtering_differentiator_flow,
)
from fmu_observer.formulas.differentiation.differentiator_gains import LEVANT_GAINS
from fmu_observer.observers.train import DifferentiatorCdo

STEP, END = 1e-3, 10.0


def sine_errors(
    flow: Callable[[np.ndarray, float], np.ndarray], size: int, first: int, noise: float = 0.0
) -> np.ndarray:
    """Largest errors of the estimated derivatives of sin(t) over the last 3 s, explicit Euler."""
    x, worst = np.zeros(size), np.zeros(size - first)
    for k in range(round(END / STEP)):
        t = k * STEP
        x = x + STEP * flow(x, np.sin(t) + noise * np.cos(1000.0 * t))
        if t > END - 3.0:
            exact = np.sin(t + STEP + 0.5 * np.pi * np.arange(size - first))
            worst = np.maximum(worst, np.abs(x[first:] - exact))
    return worst


@pytest.mark.parametrize("order", [1, 2, 3])
def test_derivatives_of_a_sine(order: int) -> None:
    errors = sine_errors(lambda z, f: np.array(differentiator_flow(list(z), f, 1.0)), order + 1, 0)
    # At a step of 1 ms every further derivative is some ten times less accurate. With the table in the printed order
    # the independently measured errors are 0.2 (first state, order 2) and 35 (order 3).
    assert np.all(errors <= [1e-3, 0.01, 0.05, 0.3][: order + 1])


@pytest.mark.parametrize(("n", "nf"), [(1, 1), (1, 3), (2, 2)])
def test_filtering_differentiators_of_several_orders(n: int, nf: int) -> None:
    def flow(x: np.ndarray, f: float) -> np.ndarray:
        dw, dz = filtering_differentiator_flow(list(x[:nf]), list(x[nf:]), f, 1.0)
        return np.array([*dw, *dz])

    errors = sine_errors(flow, n + nf + 1, nf)
    assert errors[0] < 1e-3
    assert np.all(errors < 0.05)


def test_filtering_rejects_a_large_fast_disturbance_that_ruins_the_plain_one() -> None:
    def filtering(x: np.ndarray, f: float) -> np.ndarray:
        dw, dz = filtering_differentiator_flow(list(x[:3]), list(x[3:]), f, 1.0)
        return np.array([*dw, *dz])

    plain = sine_errors(lambda z, f: np.array(differentiator_flow(list(z), f, 1.0)), 2, 0, noise=0.5)
    filtered = sine_errors(filtering, 5, 3, noise=0.5)
    assert filtered[1] < 0.1
    assert filtered[1] < 0.25 * plain[1]


def test_exponents_of_the_filtering_form() -> None:
    """At |w_1| = 1 and zero elsewhere the right-hand sides are the gains times powers of L alone."""
    L = 16.0
    dw, dz = filtering_differentiator_flow([1.0, 0.0, 0.0], [0.0, 0.0], 0.0, L)
    gains = LEVANT_GAINS[4][::-1]
    expected = [-g * L ** ((i + 1) / 5.0) for i, g in enumerate(gains)]  # (3.18): L^(1/5) ... L^(5/5)
    np.testing.assert_allclose([*dw, *dz], expected, rtol=1e-14)
    dw, dz = filtering_differentiator_flow([32.0, 0.0, 0.0], [0.0, 0.0], 0.0, 1.0)
    expected = [-g * 2.0 ** (4 - i) for i, g in enumerate(gains)]  # |w_1|^(4/5) ... |w_1|^0 with 32 = 2^5
    np.testing.assert_allclose([*dw, *dz], expected, rtol=1e-14)


def test_table_rows_and_errors() -> None:
    assert [len(row) for row in LEVANT_GAINS] == [1, 2, 3, 4, 5, 6]
    assert LEVANT_GAINS[4] == (1.1, 4.57, 9.30, 10.03, 5.0)
    with pytest.raises(ValueError, match="order 6"):
        differentiator_flow([0.0] * 7, 0.0, 1.0)
    with pytest.raises(ValueError, match="filter state"):
        filtering_differentiator_flow([], [0.0, 0.0], 0.0, 1.0)


def test_signed_power() -> None:
    np.testing.assert_allclose(_signed_power(np.array([-8.0, 0.0, 8.0]), 1, 3), [-2.0, 0.0, 2.0])
    np.testing.assert_array_equal(_signed_power(np.array([-8.0, 0.0, 8.0]), 0, 3), [-1.0, 0.0, 1.0])


@pytest.mark.parametrize("jerk_bound", [1.0, 10.0, 100.0])
def test_chatter_of_the_adhesion_force_at_the_internal_step(jerk_bound: float) -> None:
    """The bound the class states for the Runge-Kutta step on the discontinuous equations: (J / r^2) jerk_bound h."""
    motion = SteadyMotion(speed=10.0)
    runner = SystemRunner(DifferentiatorCdo(), jerk_bound=jerk_bound)
    runner.set("x", {"wheel_rate": motion.speed / RADIUS})
    runner.set("u", {"effort": motion.effort(0.0), "odometer": motion.speed})
    runner.set("x", {"wheel_acceleration": 0.1})  # a small error to start the chatter from
    runner.runtime.start(0.0)
    runner.runtime.advance(5.0)
    errors = []
    for k in range(2000):
        runner.runtime.advance(5.0 + 0.001 * (k + 1))
        errors.append(runner.outputs()["adhesion_force"] - motion.adhesion_force(0.0))
    assert np.abs(errors).max() <= INERTIA / RADIUS**2 * jerk_bound * 1e-3
