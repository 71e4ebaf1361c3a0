"""Chi-square bands and verdicts: against closed forms, and how often matched and wrong filters are flagged."""

import numpy as np
import pytest
from scipy import stats

from fmu_observer.formulas.filtering.covariance_consistency import (
    _independent_count,
    _is_inside,
    average_over_runs,
    chi_square_band,
    evaluate,
    normalised_squares,
)

SEEDS, SAMPLES = 100, 400
F, H = np.array([[1.0, 0.1], [0.0, 1.0]]), np.array([[1.0, 0.0]])
Q, R = 0.1 * np.array([[1e-3 / 3.0, 0.5e-2], [0.5e-2, 0.1]]), np.array([[0.04]])


def runs(process: float = 1.0, measurement: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """NIS and NEES of 100 runs of a position filter, shape (runs, samples), that is told these multiples of Q and R."""
    random = np.random.default_rng(0)
    x = random.multivariate_normal(np.zeros(2), np.eye(2), SEEDS)
    estimate, P = np.zeros((SEEDS, 2)), np.eye(2)
    nis, nees = np.empty((SEEDS, SAMPLES)), np.empty((SEEDS, SAMPLES))
    for k in range(SAMPLES):
        x = x @ F.T + random.multivariate_normal(np.zeros(2), Q, SEEDS)
        estimate, P = estimate @ F.T, F @ P @ F.T + process * Q
        innovation = x[:, :1] + random.normal(0.0, np.sqrt(R[0, 0]), (SEEDS, 1)) - estimate[:, :1]
        S = H @ P @ H.T + measurement * R
        K = P @ H.T @ np.linalg.inv(S)
        estimate, P = estimate + innovation @ K.T, (np.eye(2) - K @ H) @ P
        nis[:, k] = normalised_squares(innovation, np.broadcast_to(S, (SEEDS, 1, 1)))
        nees[:, k] = normalised_squares(x - estimate, np.broadcast_to(P, (SEEDS, 2, 2)))
    return nis, nees


def flagged(squares: np.ndarray, degrees: float, *, white: bool) -> dict[str, float]:
    verdicts = [evaluate(row, degrees, white=white).verdict for row in squares]
    return {v: verdicts.count(v) / len(verdicts) for v in ("overconfident", "underconfident")}


@pytest.fixture(scope="module")
def matched() -> tuple[np.ndarray, np.ndarray]:
    return runs()


def test_matched_filters_are_flagged_at_the_stated_rate(matched: tuple[np.ndarray, np.ndarray]) -> None:
    """1 % of runs; of 100 at most 5 in 99.9 % of cases (binomial). NEES knows its independent samples only roughly."""
    nis, nees = matched
    most = float(stats.binom.ppf(0.999, SEEDS, 0.01)) / SEEDS
    assert sum(flagged(nis, 1.0, white=True).values()) <= most
    assert sum(flagged(nees[:, 20:], 2.0, white=False).values()) <= 0.05
    assert np.mean(_is_inside(nis, 1.0)) == pytest.approx(0.95, abs=0.005)  # 80 000 samples: 0.001
    assert np.mean(_is_inside(nees, 2.0)) == pytest.approx(0.95, abs=0.01)


def test_the_average_over_runs_lies_in_its_band(matched: tuple[np.ndarray, np.ndarray]) -> None:
    for squares, degrees in zip(matched, (1.0, 2.0), strict=True):
        averages, band = average_over_runs(squares, degrees)
        outside = np.mean((averages < band.low) | (averages > band.high))
        assert outside == pytest.approx(0.05, abs=0.04)  # of 400 instants, those of NEES correlated


def test_wrong_covariances_are_found() -> None:
    """A quarter of the process noise makes a filter overconfident, four times the measurement noise underconfident.

    Of 200 runs of 400 samples were found: by NIS 33 % and all, by NEES all and 71 %.
    """
    nis, nees = runs(process=0.25)
    assert flagged(nis, 1.0, white=True)["overconfident"] > 0.2
    assert flagged(nees, 2.0, white=False)["overconfident"] == 1.0
    nis, nees = runs(measurement=4.0)
    assert flagged(nis, 1.0, white=True)["underconfident"] == 1.0
    assert flagged(nees, 2.0, white=False)["underconfident"] > 0.6


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.95])
def test_independent_samples_of_a_first_order_series(rho: float) -> None:
    """``N (1 - rho) / (1 + rho)``."""
    random, count = np.random.default_rng(1), 20000
    values = np.zeros(count)
    for k, draw in enumerate(random.normal(size=count - 1), start=1):
        values[k] = rho * values[k - 1] + draw
    assert _independent_count(values) == pytest.approx(count * (1.0 - rho) / (1.0 + rho), rel=0.15)


def test_bands_are_those_of_scipy() -> None:
    for degrees, count in ((1.0, 1.0), (3.0, 1.0), (2.0, 50.0), (4.0, 12.5)):
        band = chi_square_band(degrees, count, 0.9)
        expected = stats.chi2.ppf([0.05, 0.95], degrees * count) / count
        np.testing.assert_allclose([band.low, band.high], expected, rtol=1e-10)


def test_squares_use_what_is_measured_and_leave_out_what_is_singular() -> None:
    P = np.array([[[4.0, 1.0], [1.0, 9.0]], [[1.0, 1.0], [1.0, 1.0]], [[0.0, 0.0], [0.0, 1.0]]])
    errors = np.array([[1.0, -2.0]] * 3)
    found = normalised_squares(errors, P)
    assert found[0] == pytest.approx(errors[0] @ np.linalg.solve(P[0], errors[0]))
    assert np.isnan(found[1:]).all()
    assert normalised_squares(errors, np.full((3, 2), 4.0)) == pytest.approx(np.full(3, 1.25))


def test_too_little_and_infinite_are_reported() -> None:
    assert evaluate(np.ones(4), 1.0, white=True).verdict == "too few samples"
    none = evaluate(np.zeros(0), 1.0, white=True)
    assert (none.verdict, none.samples, none.independent) == ("too few samples", 0, 0.0)
    assert evaluate(np.array([1.0] * 9 + [np.inf]), 1.0, white=True).verdict == "not finite"
    assert evaluate(np.full(100, 0.1), 1.0, white=True).verdict == "underconfident"
    missing = np.where(np.arange(100) % 2 == 0, 1.0, 2.0)  # a sample may have one or two measurements
    assert evaluate(missing, missing, white=True).verdict == "consistent"


def test_no_rows_have_no_squares() -> None:
    """A run that ends before the time from which it is evaluated."""
    assert normalised_squares(np.zeros((0, 1)), np.zeros((0, 1))).shape == (0,)
    assert normalised_squares(np.zeros((0, 2)), np.zeros((0, 2, 2))).shape == (0,)
