"""Formulas of the bounds: against the differential equations that they solve, the numbers of the thesis, and traced."""

from __future__ import annotations

from collections.abc import Callable
from math import exp, inf, sqrt

import casadi as ca
import numpy as np
import pytest
import scipy
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from fmu_observer.certificates.bounds import (
    cdo_bound,
    comparison_bound,
    dmo_bound,
    improved_cdo_bound,
    improved_dmo_bound,
    largest_gap,
    printed_cdo_bound,
    worst_case,
)
from fmu_observer.certificates.bounds.carried import decay_proven, first_component, level, level_of_box

SET_D_GAIN = np.array([3.4, -3.4, -1.5])
PRINTED_NORM = 5.0407  # of [3.4 + w1, -3.4, -1.5], as the independent implementation has it


def solved(rate: Callable[[float, float], float], first: float, s: float) -> float:
    return float(solve_ivp(lambda t, y: [rate(t, y[0])], (0.0, s), [first], rtol=1e-11, atol=1e-13).y[0, -1])


EQUATIONS = [  # e_k 0.3, beta 1.9, m 0.7 1/s, |K| 4 1/s, and xi 1.7 m/s2 or a deviation of 0.25 m/s
    (improved_dmo_bound, 1.7, lambda t, y: -0.7 * y + 1.9 * 4.0 * 1.7 * t),
    (improved_cdo_bound, 1.7, lambda t, y: -0.7 * y + 1.9 * 4.0 * 1.7 * t),
    (dmo_bound, 0.25, lambda _, y: -0.7 * y + 1.9 * 4.0 * 0.25),
    (cdo_bound, 0.25, lambda _, y: -(0.7 - 1.9 * 4.0) * y + 1.9 * 4.0 * 0.25),
]


@pytest.mark.parametrize(("bound", "driven", "rate"), EQUATIONS)
@pytest.mark.parametrize("s", [0.05, 0.2, 1.3])
def test_a_bound_solves_its_comparison_equation(
    bound: Callable[..., float], driven: float, rate: Callable[[float, float], float], s: float
) -> None:
    expected = solved(rate, 1.9 * 0.3, s)
    assert bound(s, 0.3, 1.9, 0.7, 4.0, driven) == pytest.approx(expected, rel=1e-8)  # that of the solution


@pytest.mark.parametrize("growth", [0.2, 0.7, 3.0])
def test_lemma_4_1_also_where_growth_equals_decay(growth: float) -> None:
    expected = solved(lambda _, y: (growth - 0.7) * y + 0.4, 1.5 * 0.3, 0.9)
    assert comparison_bound(0.9, 0.3, 1.5, 0.7, growth, 0.4) == pytest.approx(expected, rel=1e-9)


def test_the_printed_exponent_is_broken_by_an_error_that_grows() -> None:
    """``e' = -(m - a) e``: what Lemma 4-1 allows, a = 13 1/s, m = 0.1 1/s, e_k = 0.1, after 0.2 s."""
    true = 0.1 * exp(12.9 * 0.2)
    assert true == pytest.approx(1.3197, abs=5e-5)
    arguments = (0.2, 0.1, 1.0, 0.1, 13.0, 0.0)
    assert printed_cdo_bound(*arguments) == pytest.approx(0.098, abs=5e-5)
    assert cdo_bound(*arguments) == pytest.approx(true, rel=1e-14)


@pytest.mark.parametrize(("gap", "increment"), [(0.2, "0.325"), (0.4, "1.292"), (1.2, "11.3"), (1.6, "19.9")])
def test_increments_of_table_5_9(gap: float, increment: str) -> None:
    found = improved_dmo_bound(gap, 0.0, 1.90938, 0.1, PRINTED_NORM, 1.7)
    half_a_digit = 0.5 * 10.0 ** -len(increment.partition(".")[2])
    assert found == pytest.approx(float(increment), abs=half_a_digit)


def test_bounds_are_traced_as_they_are_computed() -> None:
    x = ca.SX.sym("x", 6)
    arguments = [ca.ArrayInterface.SX(x[i], shape=()) for i in range(6)]
    values = np.array([0.3, 0.2, 1.9, 0.4, 3.0, 1.7])
    for bound in (improved_dmo_bound, dmo_bound, cdo_bound, printed_cdo_bound, comparison_bound):
        traced = ca.Function(bound.__name__, [x], [ca.SX(bound(*arguments).to_casadi())])
        assert float(traced(values)) == pytest.approx(float(bound(*values)), rel=1e-14), bound.__name__


# -- gaps -------------------------------------------------------------------------------------------------------------


@given(
    sample_error=st.floats(0.0, 0.4),
    m=st.floats(0.05, 2.0),
    gain=st.floats(0.5, 8.0),
    limit=st.floats(0.9, 5.0),
)
def test_the_largest_gap_is_where_the_bound_crosses_its_limit(
    sample_error: float, m: float, gain: float, limit: float
) -> None:
    bound = lambda s: float(improved_dmo_bound(s, sample_error, 2.0, m, gain, 1.7))  # noqa: E731
    gap = largest_gap(bound, limit)
    assert bound(gap) == pytest.approx(limit, rel=1e-9)  # of the bisection
    assert all(bound(part * gap) <= limit for part in (0.0, 0.1, 0.5, 0.9, 1.0))


def test_gaps_without_a_crossing() -> None:
    kept = lambda s: float(dmo_bound(s, 0.1, 1.0, 1.0, 2.0, 0.25))  # noqa: E731  # it rises to 0.5
    assert largest_gap(kept, 0.51) == inf
    assert largest_gap(kept, 0.09) == 0.0
    with pytest.raises(ValueError, match="limit must be a positive number, got 0"):
        largest_gap(kept, 0.0)


# -- what is carried --------------------------------------------------------------------------------------------------


def definite(rng: np.random.Generator) -> np.ndarray:
    root = rng.standard_normal((3, 3))
    return np.asarray(root @ root.T + 0.1 * np.eye(3))


def test_level_and_factor_are_those_of_the_matrix() -> None:
    rng = np.random.default_rng(1)
    for _ in range(50):
        P, z = definite(rng), rng.standard_normal(3)
        assert level(P, *z) == pytest.approx(sqrt(z @ P @ z), rel=1e-12)
        assert first_component(P) == pytest.approx(sqrt(np.linalg.inv(P)[0, 0]), rel=1e-10)
        corners = [np.abs(z) * (1 - 2 * np.array(signs)) for signs in np.ndindex(2, 2, 2)]
        assert level_of_box(P, *np.abs(z)) == pytest.approx(max(sqrt(c @ P @ c) for c in corners), rel=1e-12)


def test_the_proof_by_minors_is_that_of_the_eigenvalues() -> None:
    rng = np.random.default_rng(2)
    proven = 0
    for _ in range(300):
        a11, k2, k3 = -rng.uniform(0.5, 4.0), -rng.uniform(0.2, 6.0), -rng.uniform(0.1, 4.0)
        F = np.array([[a11, -1.0, 0.0], [-k2, 0.0, 1.0], [-k3, 0.0, 0.0]])
        P = definite(rng)
        if rng.random() < 0.7 and np.linalg.eigvals(F).real.max() < -0.1:
            P = scipy.linalg.solve_continuous_lyapunov((F + 0.1 * np.eye(3)).T, -np.eye(3))
        m = rng.uniform(0.01, 0.3)
        expected = np.linalg.eigvalsh(P)[0] > 0.0 and np.linalg.eigvalsh(P @ F + F.T @ P + 2.0 * m * P)[-1] < 0.0
        assert bool(decay_proven(P, a11, (k2, k3), m)) is bool(expected)
        proven += expected
    assert 30 < proven < 270  # both answers were asked for


# -- the exact worst case ---------------------------------------------------------------------------------------------


def error_matrix(gain: np.ndarray, slope: float = 0.04) -> np.ndarray:
    return np.array([[-slope, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]) - np.outer(gain, [1.0, 0.0, 0.0])


@pytest.mark.parametrize("since_sample", [0.07, 0.2, 0.5])
def test_the_worst_acceleration_leads_to_the_worst_error(since_sample: float) -> None:
    """The acceleration that is told, by SciPy, over the last three seconds; before, the rest is below 1e-3."""
    gain, period, back = np.array([2.96, -5.513, -3.513]), 0.2, 60
    F = error_matrix(gain)
    case = worst_case(F, gain, 1.7, period, since_sample)
    end = back * period + since_sample
    e, v, held, t = np.zeros(3), 0.0, 0.0, 0.0
    step = 5e-4
    for k in range(round(end / step)):
        if k % round(period / step) == 0 and t < back * period + 1e-9:
            held = v
        acceleration = float(case.acceleration(end - t - 0.5 * step))
        middle = v - held + 0.5 * acceleration * step
        e = e + step * (F @ (e + 0.5 * step * (F @ e + gain * (v - held))) + gain * middle)
        v, t = v + acceleration * step, t + step
    assert abs(e[0]) == pytest.approx(case.error, rel=2e-3)  # steps of 0.5 ms around the changes of sign


def test_no_motion_exceeds_the_worst_case() -> None:
    gain, rng = SET_D_GAIN, np.random.default_rng(3)
    F, most = error_matrix(gain), worst_case(error_matrix(gain), SET_D_GAIN, 1.7, 0.2).error
    held = np.zeros(500)
    e, v, step = np.zeros((3, 500)), np.zeros(500), 2e-3
    largest = 0.0
    for k in range(2500):
        if k % 100 == 0:
            largest = max(largest, float(np.abs(e[0]).max()))
            held = v.copy()
        if k % 20 == 0:
            acceleration = 1.7 * np.sign(rng.uniform(-1.0, 1.0, 500))
        v_middle = v + 0.5 * step * acceleration
        half = e + 0.5 * step * (F @ e + np.outer(gain, v - held))
        e = e + step * (F @ half + np.outer(gain, v_middle - held))
        v = v + step * acceleration
    assert 0.5 * most < largest < most


@pytest.mark.parametrize("m", [0.3, 2.0])
def test_the_improved_bound_is_tight(m: float) -> None:
    """One state with ``F = -m``: beta is 1, and the largest acceleration all the time leads to the bound itself."""
    F, gain = np.array([[-m]]), np.array([m])
    case = worst_case(F, gain, 1.7, 0.2, 0.5, periods=0)
    bound = improved_dmo_bound(0.5, 0.0, 1.0, m, m, 1.7)
    assert case.error == pytest.approx(bound, rel=1e-5)  # of the trapezium rule
    assert (case.acceleration(np.linspace(0.01, 0.49, 9)) == 1.7).all()
    by_hand = solved(lambda t, e: -m * e + m * 1.7 * t, 0.2, 0.5)  # and with an error at the sample
    assert improved_dmo_bound(0.5, 0.2, 1.0, m, m, 1.7) == pytest.approx(by_hand, rel=1e-9)


def test_what_the_worst_case_refuses() -> None:
    with pytest.raises(ValueError, match=r"not stable, its slowest pole is at \+1 1/s"):
        worst_case(np.eye(2), np.ones(2), 1.7, 0.2)
    with pytest.raises(ValueError, match="the period must be finite and positive"):
        worst_case(-np.eye(2), np.ones(2), 1.7, 0.0)
    with pytest.raises(ValueError, match="not negative, got -1"):
        worst_case(-np.eye(2), np.ones(2), -1.0, 0.2)
