"""The adaptation in closed form, beside the differential equations that it solves, integrated by SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fmu_observer.formulas.adaptation.adaptation_at_samples import (
    AtSample,
    Since,
    constants_now,
    covariance_at_first,
    covariance_at_sample,
    covariance_now,
    excitation_now,
    gain_now,
    since_flow,
    state_covariance,
)
from fmu_observer.formulas.adaptation.adaptive_law import Adaptation, Plant, Sizes, error_drift, gains_of

SIZES = Sizes(2, 3, 2, sampled=True)
A, C = np.array([[0.0, 1.0], [-0.2, -0.1]]), np.array([[0.5, 0.0], [0.1, 1.0]])
SPAN, MU = 0.7, 0.4


def spread(rng: np.random.Generator, size: int) -> np.ndarray:
    root = rng.normal(size=(size, size))
    return root @ root.T


def as_of(values: np.ndarray, shapes: list[tuple[int, ...]]) -> list[np.ndarray]:
    ends = np.cumsum([0, *(int(np.prod(s)) for s in shapes)])
    return [values[a:b].reshape(s) for a, b, s in zip(ends[:-1], ends[1:], shapes, strict=True)]


@pytest.mark.parametrize("learnt", [(1.0, 1.0, 1.0), (1.0, 0.0, 1.0), (0.0, 0.0, 0.0)])
def test_between_samples_it_solves_the_equations_of_the_adaptive_law(learnt: tuple[float, ...]) -> None:
    """Held constants are those of a gain without them; the gain R itself is that of all."""
    rng = np.random.default_rng(5)
    mask = np.array(learnt)
    R, seen, sensitivity, c, delta = (
        spread(rng, 3),
        rng.normal(size=(2, 3)),
        rng.normal(size=(2, 3)),
        rng.normal(size=2),
        rng.normal(size=3),
    )
    V, noise, Phi = spread(rng, 7), spread(rng, 2), rng.normal(size=(2, 3))
    shapes = [(2, 2), (2, 3), (2, 3), (3, 3), (3, 3), (7, 7), (3,), (2,)]
    reported = np.zeros((7, 7))  # (eta, constants, c) to (xh - x, constants, w - y)
    reported[:2, :2], reported[:2, 2:5], reported[2:5, 2:5] = np.eye(2), sensitivity, np.eye(3)
    reported[5:, :5], reported[5:, 5:] = C @ reported[:2, :5], -np.eye(2)
    disturbed = np.vstack([np.eye(2), np.zeros((3, 2)), C])

    def flow(_t: float, values: np.ndarray) -> np.ndarray:
        Z, L, chi, gain, held, W, _delta, c_now = as_of(values, shapes)
        adaptation = Adaptation(held, L, chi, Z, held, W)
        gains = gains_of(adaptation, C, np.ones(3))
        plant = Plant(A, np.zeros(2), Phi, C)
        drift = error_drift(plant, gains, SIZES, True)
        own = gains.state
        rates = -gains.constants @ c_now
        return np.concatenate(
            [
                np.ravel(v)
                for v in (
                    MU * Z + A @ Z + Z @ A.T - own @ own.T,
                    A @ L - own @ chi + Phi,
                    -(C @ own) @ chi,
                    -gain @ chi.T @ chi @ gain,
                    -held @ chi.T @ chi @ held,
                    drift @ W + W @ drift.T + disturbed @ noise @ disturbed.T,
                    rates,
                    -(C @ own) @ c_now + chi @ rates,
                )
            ]
        )

    first = (np.eye(2), sensitivity, seen, R, np.diag(mask) @ R @ np.diag(mask), reported @ V @ reported.T, delta, c)
    solved = solve_ivp(
        flow, (0.0, SPAN), np.concatenate([np.ravel(v) for v in first]), "DOP853", rtol=1e-11, atol=1e-12
    )
    _Z, L, _chi, gain, _held, W, found, c_now = as_of(solved.y[:, -1], shapes)

    known = AtSample(delta, c, R, seen, np.zeros((3, 3)), V, mask)
    since = run(noise)
    now = constants_now(known, since)
    np.testing.assert_allclose(now.values, found, rtol=1e-8)
    np.testing.assert_allclose(now.innovation, c_now, rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(now.rates, flow(SPAN, solved.y[:, -1])[-5:-2], rtol=1e-7, atol=1e-10)
    np.testing.assert_allclose(gain_now(known, since, 0.0, 0.0), gain, rtol=1e-8)
    covariance = state_covariance(covariance_now(known, since, now.by_innovation, SIZES), L, SIZES)
    np.testing.assert_allclose(covariance, W[:5, :5], rtol=1e-7, atol=1e-9)


def run(noise: np.ndarray) -> Since:
    """What happens in `SPAN`, integrated, S beginning at one."""
    shapes = [(2, 2), (1,), (2, 2), (2, 2), (2, 2), (2, 2), (2, 2)]

    def flow(_t: float, values: np.ndarray) -> np.ndarray:
        Z, elapsed, *rest = as_of(values, shapes)
        gain = Z @ C.T
        moved = since_flow(Since(elapsed[0], *rest), gain, A, C, noise)
        return np.concatenate([np.ravel(v) for v in (MU * Z + A @ Z + Z @ A.T - gain @ gain.T, *moved)])

    none = np.zeros((2, 2))
    first = (np.eye(2), 0.0, np.eye(2), none, np.eye(2), none, none)
    solved = solve_ivp(
        flow, (0.0, SPAN), np.concatenate([np.ravel(v) for v in first]), "DOP853", rtol=1e-11, atol=1e-12
    )
    _Z, elapsed, *rest = as_of(solved.y[:, -1], shapes)
    return Since(elapsed[0], *rest)


def test_forgetting_and_excitation_over_the_time_since_the_sample() -> None:
    """With nothing seen, ``d R = f R - f floor R^2`` and the excitation fades; both have closed forms."""
    R, E = np.diag([0.5, 2.0, 30.0]), np.diag([1.0, 2.0, 3.0])
    known = AtSample(np.zeros(3), np.zeros(2), R, np.zeros((2, 3)), E, np.zeros((7, 7)), np.ones(3))
    since = Since(2.0, np.eye(2), 0.1 * np.eye(2), np.eye(2), np.zeros((2, 2)), np.zeros((2, 2)))
    f, floor = 0.3, 0.2
    grown = np.exp(2.0 * f)
    scalar = grown / (1.0 / np.diag(R) + floor * (grown - 1.0))  # the logistic equation
    np.testing.assert_allclose(np.diag(gain_now(known, since, f, floor)), scalar, rtol=1e-12)
    np.testing.assert_allclose(excitation_now(known, since, 5.0), np.exp(-0.4) * E, rtol=1e-12)
    chi = np.array([[1.0, 0.0, 2.0], [0.0, 1.0, 0.0]])
    gathered = excitation_now(known._replace(seen=chi, excitation=np.zeros((3, 3))), since, 1e3)
    np.testing.assert_allclose(gathered, 1e-4 * chi.T @ chi, rtol=2e-3)


def test_covariance_at_a_sample_is_that_of_drawn_errors() -> None:
    rng = np.random.default_rng(2)
    V, sensitivity = spread(rng, 7), rng.normal(size=3)
    z = rng.multivariate_normal(np.zeros(7), V, 200_000)
    noise = 0.7 * rng.normal(size=len(z))
    read = z.copy()
    read[:, 6] = z[:, :2] @ C[1] + z[:, 2:5] @ sensitivity - noise
    found = covariance_at_sample(V, C, 1, sensitivity, 0.49, SIZES)
    np.testing.assert_allclose(found, np.cov(read.T), atol=5.0 * np.max(np.diag(found)) / np.sqrt(len(z)))
    begun = z.copy()
    begun[:, 0], begun[:, 5] = noise, 0.0
    found = covariance_at_first(V, 0, 0, 0.49, SIZES)
    np.testing.assert_allclose(found, np.cov(begun.T), atol=5.0 * np.max(np.diag(found)) / np.sqrt(len(z)))
