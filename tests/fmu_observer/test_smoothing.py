"""The smoother against filterpy, pykalman, a batch least-squares solution, and itself in other forms."""

import warnings
from typing import Any

import numpy as np
import pytest

from fmu_observer.formulas.filtering.covariance_consistency import evaluate, normalised_squares
from fmu_observer.formulas.filtering.smoothing import _FilterPass, extended_pass, smooth, unscented_pass

F = np.array([[1.0, 0.1, 0.005], [0.0, 1.0, 0.1], [0.0, 0.0, 0.97]])
H = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.2]])
Q, R = np.diag([1e-4, 1e-3, 0.02]), np.array([[0.09, 0.01], [0.01, 0.04]])
START, P = np.array([0.5, -1.0, 0.0]), np.diag([1.0, 2.0, 0.5])
COUNT = 80


def recording(seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """True states and measurements."""
    random = np.random.default_rng(seed)
    x = random.multivariate_normal(START, P)
    states = []
    for _ in range(COUNT):
        states.append(x)
        x = F @ x + random.multivariate_normal(np.zeros(3), Q)
    noise = random.multivariate_normal(np.zeros(2), R, COUNT)
    return np.array(states), np.array(states) @ H.T + noise


def linear(samples: np.ndarray, gate: float = np.inf) -> _FilterPass:
    return extended_pass(START, P, lambda _, x: (F @ x, F), Q, lambda _, x: (H @ x, H), R, samples, gate)


def test_filter_and_smoother_are_those_of_filterpy() -> None:
    filterpy: Any = pytest.importorskip("filterpy.kalman")
    _, samples = recording()
    other = filterpy.KalmanFilter(dim_x=3, dim_z=2)
    other.F, other.H, other.Q, other.R, other.P = F, H, Q, R, P
    other.x = START
    means, covariances = [], []
    for k, sample in enumerate(samples):
        if k > 0:
            other.predict()
        other.update(sample)
        means.append(other.x.copy())
        covariances.append(other.P.copy())
    passed = linear(samples)
    np.testing.assert_allclose(passed.estimates, means, atol=1e-9)
    expected, spread, _, _ = other.rts_smoother(np.array(means), np.array(covariances))
    found = smooth(passed)
    np.testing.assert_allclose(found.estimates, expected, atol=1e-9)
    np.testing.assert_allclose(found.covariances, spread, atol=1e-9)


def test_filter_and_smoother_are_those_of_pykalman_with_missing_samples() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        pykalman: Any = pytest.importorskip("pykalman")
        _, samples = recording()
        samples[10:20] = np.nan
        other = pykalman.KalmanFilter(F, H, Q, R, initial_state_mean=START, initial_state_covariance=P)
        means, covariances = other.smooth(np.ma.masked_invalid(samples))
        likelihood = other.loglikelihood(np.ma.masked_invalid(samples))
    passed = linear(samples)
    found = smooth(passed)
    np.testing.assert_allclose(found.estimates, means, atol=1e-9)
    np.testing.assert_allclose(found.covariances, covariances, atol=1e-9)
    assert passed.log_likelihood == pytest.approx(float(likelihood), abs=1e-6)
    assert np.isnan(passed.nis[10:20]).all()
    assert (passed.degrees[10:20] == 0).all()


def test_the_smoother_minimises_the_weighted_squares_of_all_at_once() -> None:
    _, samples = recording()
    count, rows, right = 12, [], []

    def add(block: np.ndarray, at: int, covariance: np.ndarray, value: np.ndarray, before: np.ndarray | None) -> None:
        root = np.linalg.inv(np.linalg.cholesky(covariance))
        row = np.zeros((len(value), 3 * count))
        row[:, 3 * at : 3 * at + 3] = block
        if before is not None:
            row[:, 3 * at - 3 : 3 * at] = before
        rows.append(root @ row)
        right.append(root @ value)

    add(np.eye(3), 0, P, START, None)
    for k in range(count):
        add(H, k, R, samples[k], None)
        if k > 0:
            add(np.eye(3), k, Q, np.zeros(3), -F)
    expected = np.linalg.lstsq(np.vstack(rows), np.hstack(right), rcond=None)[0].reshape(count, 3)
    np.testing.assert_allclose(smooth(linear(samples[:count])).estimates, expected, atol=1e-9)


def test_the_unscented_smoother_is_the_linear_one_on_a_linear_system() -> None:
    _, samples = recording()
    found = unscented_pass(START, P, lambda _, x: F @ x, Q, lambda _, x: H @ x, R, samples)
    np.testing.assert_allclose(smooth(found).estimates, smooth(linear(samples)).estimates, atol=1e-9)
    np.testing.assert_allclose(smooth(found).covariances, smooth(linear(samples)).covariances, atol=1e-9)
    assert found.log_likelihood == pytest.approx(linear(samples).log_likelihood)


def pendulum(_: int, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """One step of a pendulum, with its Jacobian."""
    moved = np.array([x[0] + 0.05 * x[1], x[1] - 0.5 * np.sin(x[0])])
    return moved, np.array([[1.0, 0.05], [-0.5 * np.cos(x[0]), 1.0]])


def test_smoothing_a_nonlinear_recording_halves_the_errors() -> None:
    """Extended and unscented, both consistent with what they tell."""
    random = np.random.default_rng(2)
    noise, seen = np.diag([1e-6, 1e-4]), np.array([[1.0, 0.0]])
    x, states = np.array([1.0, 0.0]), []
    for _ in range(300):
        states.append(x)
        x = pendulum(0, x)[0] + random.multivariate_normal(np.zeros(2), noise)
    true = np.array(states)
    samples = true[:, :1] + random.normal(0.0, 0.1, (300, 1))
    extended = extended_pass(
        np.array([0.9, 0.1]), 0.1 * np.eye(2), pendulum, noise, lambda _, x: (x[:1], seen), 0.01 * np.eye(1), samples
    )
    scattered = unscented_pass(
        np.array([0.9, 0.1]),
        0.1 * np.eye(2),
        lambda k, x: pendulum(k, x)[0],
        noise,
        lambda _, x: x[:1],
        0.01 * np.eye(1),
        samples,
    )
    for passed in (extended, scattered):
        found = smooth(passed)
        filtered, smoothed = (np.square(e - true).mean(axis=0) for e in (passed.estimates, found.estimates))
        assert (smoothed < 0.7 * filtered).all()
        squares = normalised_squares(found.estimates - true, found.covariances)
        assert evaluate(squares, 2.0, white=False).verdict == "consistent"
        assert (found.deviations <= np.sqrt(np.einsum("kii->ki", passed.covariances)) + 1e-12).all()


def test_a_gate_leaves_out_what_is_far_off() -> None:
    _, samples = recording()
    outlier = samples.copy()
    outlier[40, 0] += 50.0
    missing = samples.copy()
    missing[40, 0] = np.nan
    np.testing.assert_array_equal(linear(outlier, gate=6.0).estimates, linear(missing, gate=6.0).estimates)
    assert linear(outlier, gate=6.0).degrees[40] == 1


def test_a_state_without_noise_is_smoothed_too() -> None:
    """A singular predicted covariance: a constant, known exactly."""
    constant = np.array([[1.0, 0.1], [0.0, 1.0]])
    samples = np.arange(10.0)[:, None]
    passed = extended_pass(
        np.zeros(2),
        np.diag([1.0, 0.0]),
        lambda _, x: (constant @ x, constant),
        np.zeros((2, 2)),
        lambda _, x: (x[:1], np.array([[1.0, 0.0]])),
        np.eye(1),
        samples,
    )
    found = smooth(passed)
    assert np.isfinite(found.estimates).all()
    np.testing.assert_allclose(found.estimates[:, 0], found.estimates[0, 0], atol=1e-12)
