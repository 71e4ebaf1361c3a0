"""Least squares on simulations: against the closed form of a line, and where neighbouring residuals are alike."""

from __future__ import annotations

import numpy as np
import pytest
import scipy
from hypothesis import given, settings
from hypothesis import strategies as st

from cosim.calibration import noise_model
from cosim.calibration.least_squares import fit
from cosim.calibration.noise_model import noise_of

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


@pytest.mark.parametrize(("count", "within"), [(10, 1e-6), (COUNT, 3e-3)])
def test_white_noise_gives_the_covariance_of_textbooks(count: int, within: float) -> None:
    """Many samples show that it is white, of few that is taken for granted."""
    _, covariance, exact = of_a_line(0.1 * np.random.default_rng(4).standard_normal(count), count)
    np.testing.assert_allclose(covariance, exact, rtol=within, atol=1e-6 * exact.max())


@given(seed=st.integers(0, 2**31), count=st.integers(20, 120), correlation=st.floats(0.0, 0.95))
@settings(max_examples=20)
def test_the_noise_is_the_mean_over_models_by_their_restricted_likelihoods(
    seed: int, count: int, correlation: float
) -> None:
    """Against whole matrices: contrasts K with ``K' J = 0`` have the density of a normal law without parameters."""
    rng = np.random.default_rng(seed)
    slopes, residuals = rng.standard_normal((count, 2)), of_first_order(correlation, rng, count)
    contrasts = scipy.linalg.null_space(slopes.T)
    seen, free = contrasts.T @ residuals, count - 2
    scores, spreads = [], []
    for r in (0.0, *noise_model._correlations(count)):
        for share in noise_model._SHARES if r else (0.0,):
            matrix = (1.0 - share) * np.eye(count) + share * scipy.linalg.toeplitz(r ** np.arange(count))
            own = contrasts.T @ matrix @ contrasts
            variance = seen @ np.linalg.solve(own, seen) / free
            scores.append(-0.5 * (free * np.log(variance) + np.linalg.slogdet(own)[1]))
            spreads.append(variance * slopes.T @ matrix @ slopes)
    before = np.array([0.5, *np.full(len(scores) - 1, 0.5 / (len(scores) - 1))])
    weights = before * np.exp(np.array(scores) - max(scores))
    expected = np.einsum("g,gij->ij", weights / weights.sum(), np.array(spreads))
    np.testing.assert_allclose(noise_of(residuals, slopes).spread, expected, rtol=1e-6)


def of_first_order(correlation: float, rng: np.random.Generator, count: int = COUNT) -> np.ndarray:
    """Noise of standard deviation 0.1, of which neighbours are correlated."""
    drive = np.sqrt(1.0 - correlation**2) * 0.1
    return np.asarray(scipy.signal.lfilter([drive], [1.0, -correlation], rng.standard_normal(count + 200))[200:])


def test_noise_with_a_memory_makes_the_region_wider() -> None:
    """First-order noise of correlation 0.8: variances are (1 + 0.8) / (1 - 0.8) = 9 times those of white noise."""
    _, covariance, white = of_a_line(of_first_order(0.8, np.random.default_rng(5)))
    assert np.all((np.diag(covariance) / np.diag(white) > 8.0) & (np.diag(covariance) / np.diag(white) < 11.0))


def counted(noise: np.ndarray) -> float:
    """How many samples count as one, beside the fit of a constant."""
    return noise_of(noise - noise.mean(), np.ones((len(noise), 1))).samples_per_independent


def test_white_noise_is_seldom_taken_for_correlated_and_correlated_noise_seldom_for_white() -> None:
    """Both error rates at 200 samples, over 100 drawings. Noise of which neighbours differ counts as white."""
    rng = np.random.default_rng(8)
    rates = {
        correlation: np.mean([counted(of_first_order(correlation, rng, 200)) > 1.0 for _ in range(100)])
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
    assert 6.0 < counted(noise) < 12.0


def test_samples_that_were_not_taken_do_not_dilute_the_correlation() -> None:
    """Every third sample is there: the neighbours are those that are, with correlation 0.8^3."""
    noise = of_first_order(0.8, np.random.default_rng(6))
    measured = X @ TRUE + noise
    measured[np.arange(COUNT) % 3 != 0] = np.nan
    found = fit(lambda p: (p @ X.T)[:, None, :], np.array([1.0, 1.0]), measured[None, :])
    assert found.correlation[0] == pytest.approx(0.8**3, abs=0.1)
    assert found.noise[0] == pytest.approx(0.1, rel=0.1)
    assert found.samples_per_independent[0] == pytest.approx((1.0 + 0.8**3) / (1.0 - 0.8**3), rel=0.3)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("size", [1.0, 1e-100])
@pytest.mark.parametrize("truth", [[2.0, -3.0], [2.0, 0.0]])
def test_a_perfect_fit_is_found_without_a_warning(truth: list[float], size: float) -> None:
    """Two signals, of which one is constant where the slope is 0: nothing is left of either."""

    def simulate(p: np.ndarray) -> np.ndarray:
        return size * np.stack([p[:, :1] * np.exp(X[:20, 1]), p[:, 1:] * X[:20, 1] + 1.0], axis=1)

    found = fit(simulate, np.array([1.0, 1.0]), simulate(np.array([truth]))[0])
    np.testing.assert_allclose(found.parameters, truth, atol=1e-9)  # of steps of the fit
    assert np.all(found.half_widths(0.95) < 1e-9)
    assert found.covers(np.array(truth), 0.95) or np.ptp(found.residuals) > 0.0
