"""The printed bounds against the independently measured numbers, and the exact limits beside them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fmu_observer.certificates.printed_bounds.sampled_bounds import (
    _longest_gap_1_52,
    _longest_gap_3_32,
    _longest_gap_3_67,
    gain_matrix,
    lipschitz_constant,
    sampled_findings,
    smallest_theta_1_51,
    smallest_theta_3_31,
)

CHAPTER_3 = {"mass": 90000.0, "davis_b": 32.0, "davis_c": 1.7}
BETA_50_KMH = lipschitz_constant(**CHAPTER_3, top_speed=50.0 / 3.6)
BETA_50_MS = lipschitz_constant(**CHAPTER_3, top_speed=50.0)
DIGITS = 5.1e-5  # [s], the measured bounds are given to four decimals, some cut off and not rounded


@pytest.mark.parametrize(("theta", "gap"), [(1.0, 0.0853), (2.0, 0.0427), (4.0, 0.0214), (5.0, 0.0171), (8.0, 0.0107)])
def test_the_bounds_of_chapter_3(theta: float, gap: float) -> None:
    assert _longest_gap_3_32(theta, BETA_50_KMH) == pytest.approx(gap, abs=DIGITS)
    relative = BETA_50_KMH / theta  # (3.67) has theta + beta for one theta
    assert _longest_gap_3_67(theta, BETA_50_KMH) * (1.0 + relative) == pytest.approx(
        _longest_gap_3_32(theta, BETA_50_KMH)
    )
    assert _longest_gap_3_67(theta) == pytest.approx(_longest_gap_3_32(theta, 0.0))


@pytest.mark.parametrize(("theta", "gap"), [(1.0, 0.0271), (8.0, 0.0034)])
def test_the_bound_of_chapter_1(theta: float, gap: float) -> None:
    assert _longest_gap_1_52(theta, BETA_50_KMH) == pytest.approx(gap, abs=DIGITS)


def test_the_smallest_gains() -> None:
    assert pytest.approx(0.022, abs=5e-4) == smallest_theta_1_51(BETA_50_MS)
    assert pytest.approx(0.042, abs=5e-4) == smallest_theta_3_31(BETA_50_KMH)
    assert _longest_gap_3_32(smallest_theta_3_31(BETA_50_KMH), BETA_50_KMH) == pytest.approx(0.0, abs=1e-9)


def test_the_gap_of_the_thesis_is_47_times_its_own_bound() -> None:
    assert 0.5 / _longest_gap_3_32(8.0, BETA_50_KMH) == pytest.approx(47.0, abs=0.5)


def test_the_matrix_solves_its_equation() -> None:
    A, C = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[1.0, 0.0]])
    P = gain_matrix()
    np.testing.assert_allclose(P, [[1.0, -1.0], [-1.0, 2.0]], atol=1e-12)
    np.testing.assert_allclose(P + A.T @ P + P @ A, C.T @ C, atol=1e-12)
    np.testing.assert_allclose(np.linalg.solve(P, C.T)[:, 0], [2.0, 1.0], atol=1e-12)


@pytest.mark.parametrize("theta", [1.0, 2.0, 4.0, 5.0, 8.0])
def test_the_bounds_stand_beside_the_exact_limits(theta: float) -> None:
    *printed, mixed, constant = sampled_findings(theta, BETA_50_KMH)
    assert [found.kind for found in (*printed, mixed, constant)] == [*["as printed"] * 3, "sufficient", "exact"]
    assert [found.source for found in printed] == [
        f"Bouchama 2024, {n}" for n in ("(1.52)", "(3.32), (3.87)", "(3.67)")
    ]
    # 4.9999 without drag; the drag takes 2e-3 at theta 1
    assert constant.value * theta == pytest.approx(5.0, abs=0.005)
    assert mixed.value * theta == pytest.approx(4.0, abs=0.005)
    assert printed[1].value < 0.03 * mixed.value


@settings(max_examples=8, deadline=None)
@given(theta=st.floats(0.05, 50.0))
def test_the_exact_limits_go_as_one_over_theta(theta: float) -> None:
    *_, mixed, constant = sampled_findings(theta)
    assert mixed.value * theta == pytest.approx(4.0, abs=0.002)  # bisection to 2e-4, and the first digits of 3.9997
    assert constant.value * theta == pytest.approx(5.0, abs=1e-3)


def test_a_gain_must_be_positive() -> None:
    with pytest.raises(ValueError, match="theta must be positive"):
        sampled_findings(0.0)
