"""Models over one sampling period: the zero-order hold, the nonlinear transition, its Jacobian, Van Loan's
covariance.
"""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad_vec, solve_ivp
from scipy.linalg import expm
from scipy.signal import cont2discrete
from uio_gains import process_covariance

from fmu_observer.models.discrete_model import _zero_order_hold, transition
from fmu_observer.models.exhibits.pendulum_model import linear_pendulum, pendulum
from fmu_observer.models.train.freight_train_model import freight_train


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 5), st.integers(1, 3), st.integers(0, 10_000), st.floats(-3.0, 1.0))
def test_the_zero_order_hold_is_that_of_scipy(n: int, m: int, seed: int, size: float) -> None:
    generator = np.random.default_rng(seed)
    A, B = generator.normal(size=(n, n)), generator.normal(size=(n, m))
    period = 10.0**size / max(np.linalg.norm(np.hstack([A, B]), 2), 1e-9)
    Ad, Bd, *_ = cont2discrete((A, B, np.eye(n), np.zeros((n, m))), period)
    found = _zero_order_hold(A, B, period)
    largest = np.exp(10.0**size)  # squaring six times costs 2^6 roundings of the largest exponential there can be
    np.testing.assert_allclose(found[0], Ad, atol=1e-13 * largest)
    np.testing.assert_allclose(found[1], Bd, atol=1e-13 * largest)


def test_it_traces_with_the_period_as_a_symbol() -> None:
    period = ca.SX.sym("T")
    Ad, Bd = _zero_order_hold(linear_pendulum().A, linear_pendulum().B, ca.ArrayInterface.SX(period, shape=()))
    traced = ca.Function("hold", [period], [ca.SX(Ad), ca.SX(Bd)])(0.3)
    for one, other in zip(traced, _zero_order_hold(linear_pendulum().A, linear_pendulum().B, 0.3), strict=True):
        np.testing.assert_allclose(np.asarray(one), other, rtol=1e-14, atol=1e-15)


@pytest.mark.parametrize("make", [pendulum, freight_train], ids=["pendulum", "freight_train"])
@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_the_nonlinear_transition_is_the_flow(make: object, seed: int) -> None:
    model, generator = make(), np.random.default_rng(seed)  # type: ignore[operator]
    x, u = generator.uniform(1.0, 3.0, 2), generator.normal(size=1)
    exact = solve_ivp(lambda _t, at: model.flow(at, u), (0.0, 0.1), x, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    # Four Runge-Kutta steps of 25 ms: (0.025)^5 / 120 a step and a unit of the fifth derivative.
    np.testing.assert_allclose(transition(model, x, u, 0.1), exact, atol=1e-8)


def test_van_loan_against_the_integral() -> None:
    A, density = np.array([[0.0, 1.0], [-1.0, -0.2]]), np.array([[0.1, 0.02], [0.02, 0.3]])
    exact, _ = quad_vec(lambda s: expm(A * s) @ density @ expm(A.T * s), 0.0, 0.7, epsabs=1e-13)
    np.testing.assert_allclose(process_covariance(A, density, 0.7), exact, atol=1e-12)
