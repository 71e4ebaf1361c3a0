"""The printed bounds against the independently measured numbers, and the exact limits beside them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fmu_observer.certificates.printed_bounds.sampled_bounds import (
    bound_table,
    bound_text,
    gain_matrix,
    lipschitz_constant,
    longest_gap_1_52,
    longest_gap_3_32,
    longest_gap_3_67,
    longest_gap_3_87,
    smallest_theta_1_51,
    smallest_theta_3_31,
)

CHAPTER_3 = {"mass": 90000.0, "davis_b": 32.0, "davis_c": 1.7}
BETA_50_KMH = lipschitz_constant(**CHAPTER_3, top_speed=50.0 / 3.6)
BETA_50_MS = lipschitz_constant(**CHAPTER_3, top_speed=50.0)
DIGITS = 5.1e-5  # [s], the measured bounds are given to four decimals, some cut off and not rounded


@pytest.mark.parametrize(("theta", "gap"), [(1.0, 0.0853), (2.0, 0.0427), (4.0, 0.0214), (5.0, 0.0171), (8.0, 0.0107)])
def test_the_bounds_of_chapter_3(theta: float, gap: float) -> None:
    assert longest_gap_3_32(theta, BETA_50_KMH) == pytest.approx(gap, abs=DIGITS)
    assert longest_gap_3_87(theta, BETA_50_KMH) == longest_gap_3_32(theta, BETA_50_KMH)
    relative = BETA_50_KMH / theta  # (3.67) has theta + beta for one theta
    assert longest_gap_3_67(theta, BETA_50_KMH) * (1.0 + relative) == pytest.approx(
        longest_gap_3_32(theta, BETA_50_KMH)
    )
    assert longest_gap_3_67(theta) == pytest.approx(longest_gap_3_32(theta, 0.0))


@pytest.mark.parametrize(("theta", "gap"), [(1.0, 0.0271), (8.0, 0.0034)])
def test_the_bound_of_chapter_1(theta: float, gap: float) -> None:
    assert longest_gap_1_52(theta, BETA_50_KMH) == pytest.approx(gap, abs=DIGITS)


def test_the_smallest_gains() -> None:
    assert pytest.approx(0.022, abs=5e-4) == smallest_theta_1_51(BETA_50_MS)
    assert pytest.approx(0.042, abs=5e-4) == smallest_theta_3_31(BETA_50_KMH)
    assert longest_gap_3_32(smallest_theta_3_31(BETA_50_KMH), BETA_50_KMH) == pytest.approx(0.0, abs=1e-9)


def test_the_gap_of_the_thesis_is_47_times_its_own_bound() -> None:
    assert 0.5 / longest_gap_3_32(8.0, BETA_50_KMH) == pytest.approx(47.0, abs=0.5)


def test_the_matrix_solves_its_equation() -> None:
    A, C = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[1.0, 0.0]])
    P = gain_matrix()
    np.testing.assert_allclose(P, [[1.0, -1.0], [-1.0, 2.0]], atol=1e-12)
    np.testing.assert_allclose(P + A.T @ P + P @ A, C.T @ C, atol=1e-12)
    np.testing.assert_allclose(np.linalg.solve(P, C.T)[:, 0], [2.0, 1.0], atol=1e-12)


def test_the_table_stands_beside_the_exact_limits() -> None:
    rows = bound_table(lipschitz=BETA_50_KMH)
    for row in rows:
        # 4.9999 without drag; the drag takes 2e-3 at theta 1
        assert row.constant * row.theta == pytest.approx(5.0, abs=0.005)
        assert row.aperiodic * row.theta == pytest.approx(4.0, abs=0.005)
        assert row.by_3_32 < 0.03 * row.aperiodic
    lines = bound_text(rows).splitlines()
    assert [line.split()[0] for line in lines[1:]] == ["1", "2", "4", "5", "8"]
    assert lines[-1].split()[1:4] == ["0.0034", "0.0107", "0.0107"]


@settings(max_examples=8, deadline=None)
@given(theta=st.floats(0.05, 50.0))
def test_the_exact_limits_go_as_one_over_theta(theta: float) -> None:
    (row,) = bound_table([theta])
    assert row.aperiodic * theta == pytest.approx(4.0, abs=0.002)  # bisection to 2e-4, and the first digits of 3.9997
    assert row.constant * theta == pytest.approx(5.0, abs=1e-3)


def test_a_gain_must_be_positive() -> None:
    with pytest.raises(ValueError, match="theta must be positive"):
        bound_table([0.0])
