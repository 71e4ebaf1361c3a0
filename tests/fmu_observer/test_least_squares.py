"""Least squares on simulations: against the closed form of a line, and where neighbouring residuals are alike."""

from __future__ import annotations

import numpy as np
import pytest
import scipy

from fmu_observer.identification.least_squares import fit

COUNT = 4000
X = np.stack([np.ones(COUNT), np.linspace(-1.0, 1.0, COUNT)], axis=1)
TRUE = np.array([2.0, -3.0])


def of_a_line(noise: np.ndarray, count: int = COUNT) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Estimate, covariance, and the covariance of textbooks, ``RSS / (n - p) inv(X' X)``."""
    rows = X[:: COUNT // count]
    measured = rows @ TRUE + noise
    found = fit(lambda p: (rows @ p)[None, :], np.array([1.0, 1.0]), measured[None, :])
    exact = np.linalg.lstsq(rows, measured, rcond=None)[0]
    np.testing.assert_allclose(found.parameters, exact, rtol=1e-7)
    left = measured - rows @ exact
    return found.parameters, found.covariance, left @ left / (count - 2) * np.linalg.inv(rows.T @ rows)


@pytest.mark.parametrize("count", [10, COUNT])
def test_white_noise_gives_the_covariance_of_textbooks(count: int) -> None:
    _, covariance, exact = of_a_line(0.1 * np.random.default_rng(4).standard_normal(count), count)
    np.testing.assert_allclose(covariance, exact, rtol=1e-6, atol=1e-6 * exact.max())


def test_noise_with_a_memory_makes_the_region_wider() -> None:
    """First-order noise of correlation 0.8: variances are (1 + 0.8) / (1 - 0.8) = 9 times those of white noise; the
    correlation is known to about 0.01, so the factor to 10 %.
    """
    noise = scipy.signal.lfilter([0.1], [1.0, -0.8], np.random.default_rng(5).standard_normal(COUNT))
    _, covariance, white = of_a_line(noise)
    np.testing.assert_allclose(np.diag(covariance) / np.diag(white), 9.0, rtol=0.2)
