"""Lyapunov functions are recomputed: what the solver says does not count."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from fmu_observer.certificates import quadratic
from fmu_observer.certificates.aperiodic import certify_sampled_error
from fmu_observer.certificates.matrix_exponential import small_exponential
from fmu_observer.certificates.quadratic import QuadraticForm, common_quadratic_form, decrease, transition_condition
from fmu_observer.certificates.sampled_error import SampledError

MODEL = SampledError.of([[0.0, 1.0], [0.0, -0.01]], (16.0, 64.0), 16.0)


def test_a_lying_solver_is_not_believed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(quadratic, "common_quadratic_form", lambda _condition: QuadraticForm(np.eye(2), 1.0))
    other = replace(MODEL, decay=16.001)  # not in the cache
    certificate = certify_sampled_error((other,), 0.4, "any")
    assert not certificate.holds
    assert certificate.limit < 0.4


def test_a_failing_solver_certifies_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(quadratic, "common_quadratic_form", lambda _condition: None)
    certificate = certify_sampled_error((replace(MODEL, decay=16.002),), 0.4, "any")
    assert not certificate.holds
    assert certificate.lyapunov_matrix == ()


@settings(max_examples=200, deadline=None)
@given(gap=st.floats(1e-4, 0.45), angle=st.floats(0.0, np.pi))
def test_the_returned_matrix_decreases_at_every_gap(gap: float, angle: float) -> None:
    """Recomputed from the exponential itself, at gaps on no grid, in the observer's own coordinates."""
    certificate = certify_sampled_error((MODEL,), 0.45, "any")
    P = np.array(certificate.lyapunov_matrix)
    generator = np.array([[0.0, 1.0, -16.0], [0.0, -0.01, -64.0], [0.0, 0.0, -16.0]])
    e = np.array([np.cos(angle), 8.0 * np.sin(angle)])
    after = (expm(generator * gap) @ np.array([e[0], e[1], e[0]]))[:2]
    assert after @ P @ after < e @ P @ e


def test_a_known_pair_without_common_function_is_refused() -> None:
    """Two Schur matrices whose product is not: no common quadratic function exists."""
    F = np.array([[0.5, 2.0], [0.0, 0.5]])
    assert np.abs(np.linalg.eigvals(F @ F.T)).max() > 1.0
    candidate = common_quadratic_form(transition_condition(np.stack([F, F.T])))
    assert candidate is None or decrease(transition_condition(np.stack([F, F.T])), candidate.P).max() > 0.0


@pytest.mark.parametrize("n", [1, 2, 3, 6])
def test_one_stable_matrix_of_any_size_has_one(n: int) -> None:
    generator = np.random.default_rng(n)
    F = generator.normal(size=(n, n))
    F *= 0.9 / np.abs(np.linalg.eigvals(F)).max()
    candidate = common_quadratic_form(transition_condition(F[None]))
    assert candidate is not None
    assert decrease(transition_condition(F[None]), candidate.P).max() < 0.0
    assert np.trace(candidate.P) == pytest.approx(n, rel=1e-6)  # the solver's own tolerance


@pytest.mark.parametrize("norm", [0.0, 1e-3, 1.0, 30.0])
@pytest.mark.parametrize("n", [1, 3, 7])
def test_the_small_exponential_is_scipys(n: int, norm: float) -> None:
    matrix = np.random.default_rng(n).normal(size=(n, n))
    matrix *= norm / np.linalg.norm(matrix)
    expected = expm(matrix)
    # squaring multiplies rounding by the norm
    np.testing.assert_allclose(small_exponential(matrix), expected, atol=1e-14 * (1.0 + norm) * np.abs(expected).max())
