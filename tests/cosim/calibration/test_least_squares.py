"""Least squares on simulations: against the closed form of a line, and where neighbouring residuals are alike."""

from __future__ import annotations

import numpy as np
import pytest
import scipy

from cosim.calibration.least_squares import fit, samples_per_independent

COUNT = 4000
X = np.stack([np.ones(COUNT), np.linspace(-1.0, 1.0, COUNT)], axis=1)
TRUE = np.array([2.0, -3.0])


def of_a_line(noise: np.ndarray, count: int = COUNT) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Estimate, covariance, and the covariance of textbooks, ``RSS / (n - p) inv(X' X)``."""
    rows = X[:: COUNT // count]
    measured = rows @ TRUE + noise
    found = fit(lambda p: (p @ rows.T)[:, None, :], np.array([1.0, 1.0]), measured[None, :])
    exact = np.linalg.lstsq(rows, measured, rcond=None)[0]
    np.testing.assert_allclose(found.parameters, exact, rtol=1e-7)
    left = measured - rows @ exact
    return found.parameters, found.covariance, left @ left / (count - 2) * np.linalg.inv(rows.T @ rows)


@pytest.mark.parametrize("count", [10, COUNT])
def test_white_noise_gives_the_covariance_of_textbooks(count: int) -> None:
    _, covariance, exact = of_a_line(0.1 * np.random.default_rng(4).standard_normal(count), count)
    np.testing.assert_allclose(covariance, exact, rtol=1e-6, atol=1e-6 * exact.max())


def of_first_order(correlation: float, rng: np.random.Generator, count: int = COUNT) -> np.ndarray:
    """Noise of standard deviation 0.1, of which neighbours are correlated."""
    drive = np.sqrt(1.0 - correlation**2) * 0.1
    return np.asarray(scipy.signal.lfilter([drive], [1.0, -correlation], rng.standard_normal(count + 200))[200:])


def test_noise_with_a_memory_makes_the_region_wider() -> None:
    """First-order noise of correlation 0.8: variances are (1 + 0.8) / (1 - 0.8) = 9 times those of white noise; the
    largest of several estimates of that, each known to 10 to 20 %, is no smaller.
    """
    _, covariance, white = of_a_line(of_first_order(0.8, np.random.default_rng(5)))
    assert np.all((np.diag(covariance) / np.diag(white) > 8.0) & (np.diag(covariance) / np.diag(white) < 13.0))


def test_white_noise_is_seldom_taken_for_correlated_and_correlated_noise_seldom_for_white() -> None:
    """Both error rates at 200 samples, over 300 drawings: of white noise 2.3 % lie beyond two standard deviations; of a
    correlation of 0.4, known to 0.065, one in 10^4 lies below 0.14. Noise of which neighbours differ counts as white.
    """
    rng = np.random.default_rng(8)
    rates = {
        correlation: np.mean(
            [samples_per_independent(of_first_order(correlation, rng, 200), 0) > 1.0 for _ in range(300)]
        )
        for correlation in (0.0, 0.4, -0.4)
    }
    assert rates[0.0] < 0.06
    assert rates[0.4] > 0.99
    assert rates[-0.4] < 0.06


def test_a_slow_part_below_white_noise_is_found() -> None:
    """Correlation 0.95 in a fifth of the variance: neighbours show 0.19, which would count 1.5 samples as one; it is
    (1 + 0.2 * 2 * 0.95 / 0.05) = 8.6.
    """
    rng = np.random.default_rng(9)
    noise = 0.2 * rng.standard_normal(COUNT) + of_first_order(0.95, rng)
    assert 3.0 < samples_per_independent(noise, 2) < 12.0


def test_samples_that_were_not_taken_do_not_dilute_the_correlation() -> None:
    """Every third sample is there: the neighbours are those that are, with correlation 0.8^3."""
    noise = of_first_order(0.8, np.random.default_rng(6))
    measured = X @ TRUE + noise
    measured[np.arange(COUNT) % 3 != 0] = np.nan
    found = fit(lambda p: (p @ X.T)[:, None, :], np.array([1.0, 1.0]), measured[None, :])
    assert found.correlation[0] == pytest.approx(0.8**3, abs=0.1)
