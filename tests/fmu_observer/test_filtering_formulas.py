"""The formulas of Kalman filters, against one another, filterpy, and the printed sums with their weights."""

from collections.abc import Callable

import casadi as ca
import filterpy.kalman
import numpy as np
import pytest
import scipy

from fmu_observer.formulas.filtering import kalman, square_root, unscented

SX = ca.ArrayInterface.SX


def covariance_of(generator: np.random.Generator, n: int) -> np.ndarray:
    columns = generator.normal(size=(n, n + 2))
    return columns @ columns.T


def transformed(
    x: np.ndarray, P: np.ndarray, function: Callable[[np.ndarray], np.ndarray], w: unscented.Weights
) -> tuple[np.ndarray, np.ndarray]:
    """Mean and covariance of a function of Gaussian numbers: Allaoui 2024, (2.32)-(2.36)."""
    return unscented.moments(
        unscented.scattered(function, unscented.sigma_points(x, square_root.factor(P), w.spread)), w
    )


def case(seed: int = 0, n: int = 4, q: int = 2) -> dict[str, np.ndarray]:
    generator = np.random.default_rng(seed)
    return {
        "x": generator.normal(size=n),
        "P": covariance_of(generator, n),
        "F": generator.normal(size=(n, n)),
        "QN": covariance_of(generator, n),
        "H": generator.normal(size=(q, n)),
        "RN": covariance_of(generator, q),
        "innovation": generator.normal(size=q),
    }


def bent(x: np.ndarray) -> np.ndarray:
    return np.stack([np.sin(x[0]) + x[1] * x[2], x[1] * x[1], x[0] - x[2]])


def test_short_and_joseph_forms_agree() -> None:
    c = case()
    found = [kalman.correct(c["x"], c["P"], c["innovation"], c["H"], c["RN"], form=f) for f in ("short", "joseph")]
    for short, joseph in zip(*found, strict=True):
        np.testing.assert_allclose(short, joseph, rtol=0.0, atol=1e-12)  # rounding of numbers of size 10


ROUNDING = 50.0 * np.finfo(float).eps
"""Of a sum of products of 3 by 3 matrices, relative to the covariance before the reading: about 50 operations."""


def smallest_variance(form: kalman.Form, seed: int) -> float:
    """Over 20 pairs of nearly equal readings, relative to the covariance before.

    Two readings of one direction but for 1e-6, 1e-7 precise each: the condition of S is above 1e12, so rounding of
    any processor makes the gain wrong by about 1e-4.
    """
    generator, x, P, smallest = np.random.default_rng(seed), np.zeros(3), np.eye(3), 1.0
    for _ in range(20):
        row, before = generator.normal(size=3), float(np.linalg.norm(P, 2))
        H = np.stack([row, row + 1e-6 * generator.normal(size=3)])
        P = kalman.correct(x, P, x[:2], H, 1e-14 * np.eye(2), form=form).covariance
        smallest = min(smallest, float(np.linalg.eigvalsh(P)[0]) / before)
        P = P + np.eye(3)
    return smallest


def test_the_joseph_form_stays_positive_but_for_rounding_where_the_short_one_does_not() -> None:
    """An error of the gain enters the Joseph form by its square, the short form by itself (Bucy and Joseph 1968)."""
    assert min(smallest_variance("joseph", seed) for seed in range(30)) > -ROUNDING
    assert max(smallest_variance("short", seed) for seed in range(30)) < -100.0 * ROUNDING


def test_noise_that_is_not_additive_by_hand() -> None:
    """``x+ = 2 x + 3 w``, ``y = x + 5 v``, all variances one: P- = 13, S = 38, K = 13/38, P = 13 - 169/38."""
    one = np.eye(1)
    P = kalman.predicted_covariance(one, 2.0 * one, one, 3.0 * one)
    assert P[0, 0] == 13.0
    for form in ("short", "joseph"):
        after = kalman.correct(np.zeros(1), P, np.ones(1), one, one, 5.0 * one, form=form)
        assert after.innovation_covariance[0, 0] == 38.0
        assert after.estimate[0] == pytest.approx(13.0 / 38.0, rel=1e-15)
        assert after.covariance[0, 0] == pytest.approx(13.0 - 169.0 / 38.0, rel=1e-14)


def test_square_root_forms_are_the_full_ones() -> None:
    c = case(3)
    S, Q, R = (square_root.factor(c[name]) for name in ("P", "QN", "RN"))
    np.testing.assert_allclose(S, np.linalg.cholesky(c["P"]), atol=1e-13)
    ahead = square_root.predicted_factor(S, c["F"], Q)
    np.testing.assert_allclose(ahead @ ahead.T, kalman.predicted_covariance(c["P"], c["F"], c["QN"]), rtol=1e-12)
    root = square_root.correct_factor(c["x"], S, c["innovation"], c["H"], R)
    full = kalman.correct(c["x"], c["P"], c["innovation"], c["H"], c["RN"])
    np.testing.assert_allclose(root.estimate, full.estimate, atol=1e-12)
    np.testing.assert_allclose(root.covariance @ root.covariance.T, full.covariance, atol=1e-11)
    np.testing.assert_allclose(root.gain, full.gain, atol=1e-12)
    np.testing.assert_allclose(root.innovation_covariance, full.innovation_covariance, rtol=1e-12)


def test_a_factor_keeps_what_a_covariance_loses() -> None:
    """Two measurements of the sum, 1e-9 precise each: the variance of the sum is 5e-19, half of theirs."""
    S, H = np.eye(2), np.array([[1.0, 1.0]])
    for _ in range(2):
        S = square_root.correct_factor(np.zeros(2), S, np.zeros(1), H, np.array([[1e-9]])).covariance
    summed = H @ S
    assert float((summed @ summed.T)[0, 0]) == pytest.approx(5e-19, rel=1e-6)


def test_semidefinite_covariances_have_factors() -> None:
    known = np.diag([4.0, 0.0, 9.0])
    np.testing.assert_array_equal(square_root.factor(known), np.diag([2.0, 0.0, 3.0]))
    L = square_root.triangular(np.array([[0.0, 0.0], [3.0, 4.0], [0.0, 0.0]]))
    np.testing.assert_allclose(L @ L.T, np.diag([0.0, 25.0, 0.0]), atol=1e-14)


@pytest.mark.parametrize(("alpha", "beta", "kappa"), [(1.0, 2.0, 0.0), (0.5, 2.0, 1.0), (0.7, 0.0, -1.0)])
def test_sums_are_those_printed_and_those_of_filterpy(alpha: float, beta: float, kappa: float) -> None:
    generator = np.random.default_rng(5)
    x, P = generator.normal(size=3), covariance_of(generator, 3)
    w = unscented.weights(3, alpha, beta, kappa)
    theirs = filterpy.kalman.MerweScaledSigmaPoints(3, alpha, beta, kappa)
    points = unscented.sigma_points(x, square_root.factor(P), w.spread)
    np.testing.assert_allclose(points.T, theirs.sigma_points(x, P), atol=1e-13)
    np.testing.assert_allclose([w.mean_centre, *[w.each] * 6], theirs.Wm, rtol=1e-13)
    np.testing.assert_allclose([w.covariance_centre, *[w.each] * 6], theirs.Wc, rtol=1e-13)
    values = np.array([bent(points[:, i]) for i in range(7)])
    mean, P_bent = transformed(x, P, bent, w)
    np.testing.assert_allclose(mean, theirs.Wm @ values, atol=1e-12)
    off = values - theirs.Wm @ values
    np.testing.assert_allclose(P_bent, off.T @ np.diag(theirs.Wc) @ off, atol=1e-11)


def test_small_spreads_lose_nothing() -> None:
    """For a linear function alpha = 1e-3 gives F P F' to 1e-9; the printed sums lose six digits more."""
    generator = np.random.default_rng(6)
    x, P, F = generator.normal(size=3), covariance_of(generator, 3), generator.normal(size=(3, 3))
    mean, found = transformed(x, P, lambda at: F @ at, unscented.weights(3))
    np.testing.assert_allclose(mean, F @ x, atol=1e-9)
    np.testing.assert_allclose(found, F @ P @ F.T, rtol=1e-9)


@pytest.mark.parametrize("redraw", [True, False])
def test_the_square_root_of_the_unscented_filter_is_the_full_one(redraw: bool) -> None:
    c = case(8, n=3, q=2)
    w = unscented.weights(3, 0.5)
    Q, R = square_root.factor(c["QN"]), square_root.factor(c["RN"])
    ahead = unscented.scattered(bent, unscented.sigma_points(c["x"], square_root.factor(c["P"]), w.spread))
    x = unscented.mean(ahead, w)
    P = unscented.covariance(ahead, ahead, w) + c["QN"]
    S = unscented.predicted_root(ahead, Q, w)
    np.testing.assert_allclose(S @ S.T, P, rtol=1e-12, atol=1e-12)
    points = unscented.sigma_points(x, S, w.spread)
    if not redraw:
        points = np.hstack([ahead.centre.reshape(3, 1), ahead.centre.reshape(3, 1) + ahead.deviations])
    states = unscented.scattered(lambda at: at, points)
    seen = unscented.scattered(lambda at: bent(at)[:2], points)
    y = np.array([0.3, -0.2])
    full = unscented.correct(x, P, states, seen, y, c["RN"], w)
    root = unscented.correct_root(x, states, seen, y, R, w, None if redraw else Q)
    np.testing.assert_allclose(root.estimate, full.estimate, atol=1e-11)
    np.testing.assert_allclose(root.covariance @ root.covariance.T, full.covariance, atol=1e-10)
    np.testing.assert_allclose(root.innovation_covariance, full.innovation_covariance, rtol=1e-11)


def test_likelihood_and_normalised_square_by_hand() -> None:
    e, S = np.array([1.0, 2.0]), np.diag([4.0, 2.0])
    assert kalman.normalised_square(e, S) == 2.25
    expected = -0.5 * (2.0 * np.log(2.0 * np.pi) + np.log(8.0) + 2.25)
    assert kalman.log_likelihood(e, S) == pytest.approx(expected, rel=1e-15)


def traced(function: Callable[..., np.ndarray], *values: np.ndarray) -> np.ndarray:
    symbols = [ca.SX.sym(f"a{i}", *v.shape) for i, v in enumerate(values)]
    arrays = [SX(s, shape=v.shape) for s, v in zip(symbols, values, strict=True)]
    return np.asarray(ca.Function("f", symbols, [ca.SX(function(*arrays))])(*values), dtype=float)


def test_formulas_trace() -> None:
    c, w = case(9, n=3), unscented.weights(3)
    P, columns = c["P"], np.hstack([c["F"], c["QN"]])
    np.testing.assert_allclose(traced(square_root.factor, P), square_root.factor(P), rtol=1e-13)
    np.testing.assert_allclose(traced(square_root.triangular, columns), square_root.triangular(columns), atol=1e-12)

    def joseph(x: np.ndarray, P: np.ndarray, e: np.ndarray) -> np.ndarray:
        return np.asarray(kalman.correct(x, P, e, c["H"], c["RN"]).covariance)

    found = traced(lambda *a: kalman.correct(*a, c["H"], c["RN"]).covariance, c["x"], P, c["innovation"])
    np.testing.assert_allclose(found, joseph(c["x"], P, c["innovation"]), rtol=1e-10)
    found = traced(lambda x, P: transformed(x, P, bent, w)[1], c["x"], P)
    np.testing.assert_allclose(found, transformed(c["x"], P, bent, w)[1], rtol=1e-7)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_integrated_noise_is_that_of_the_chain_of_integrators(order: int) -> None:
    A, noise = np.eye(order, k=1), np.zeros((order, order))
    noise[-1, -1] = 0.3
    both = scipy.linalg.expm(0.7 * np.block([[-A, noise], [np.zeros((order, order)), A.T]]))  # Van Loan 1978
    exact = both[order:, order:].T @ both[:order, order:]
    np.testing.assert_allclose(kalman.integrated_noise(order, 0.7, 0.3), exact, rtol=1e-12)
