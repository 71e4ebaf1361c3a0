"""The adaptation of an observer with a sampled sensitivity, from sample to sample in closed form. Pure functions.

[Ours], in the notation of `adaptive_law`. Between samples what the innovation depends on obeys
``d F = -C inv(S) C' F``, F = I at the sample: ``chi = F chi_k`` and ``c = F (c_k + chi_k (rhoh - rhoh_k))``. With
``d W = F' F``, W = 0 at the sample, and constants that are held from sample to sample or not, the equations of the
constants integrate exactly: for an adaptation gain ``P = H R_k H``,

    ``rhoh = rhoh_k - P chi_k' E c_k``, ``E = inv(I + W N) W``, ``N = chi_k P chi_k'``.

So a step integrates no gain and no covariance, and a large gain makes no equation stiff. Of the error
``eta = xh - x - lambda (rhoh - rho)`` the transition is carried: ``d eta = A eta - inv(S) C' F c0``, with
``c0 = c_k - chi_k (rhoh_k - rho)``. Forgetting and the floor of inv(R) act at the samples, for the time since the last.

Sizes: n states, m constants, q measurements. The covariance is that of ``(eta, rhoh - rho, c)``, in this order.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fmu_observer.formulas.adaptation.adaptive_law import Sizes
from plant_models.hybrid import Array


class Since(NamedTuple):
    """What has happened since the last sample.

    Args:
        elapsed: time [s]. decay: F, shape (q, q). fade: W [s], shape (q, q). own: transition of eta by eta, shape
            (n, n). forced: of eta by c0, shape (n, q). noise: covariance that eta has got, shape (n, n).
    """

    elapsed: Array
    decay: Array
    fade: Array
    own: Array
    forced: Array
    noise: Array


class AtSample(NamedTuple):
    """What was known just after the last sample.

    Args:
        constants: corrections of the constants, shape (m,). innovation: c, shape (q,). R: gain, shape (m, m).
        seen: chi, shape (q, m). excitation: mean of ``chi' chi``, shape (m, m). covariance: shape (n + m + q,
            n + m + q). learnt: 1 or 0 for each constant, shape (m,).
    """

    constants: Array
    innovation: Array
    R: Array
    seen: Array
    excitation: Array
    covariance: Array
    learnt: Array


class Constants(NamedTuple):
    """The constants now.

    Args:
        values: shape (m,). rates: their derivatives, shape (m,). innovation: c now, shape (q,). by_innovation: what
            the constants depend on c_k by, shape (m, q).
    """

    values: Array
    rates: Array
    innovation: Array
    by_innovation: Array


def constants_now(known: AtSample, since: Since) -> Constants:
    """Constants and innovation since the last sample, exactly.

    Args:
        known: at the sample. since: what has happened.
    """
    q = len(known.innovation)
    mask = np.reshape(known.learnt, (-1, 1))
    acts = mask * (known.R @ (mask * known.seen.T))
    N = known.seen @ acts
    E = _faded(since.fade, N)
    moved = -(acts @ (E @ known.innovation))
    c = since.decay @ (known.innovation + known.seen @ moved)
    rates = -(acts @ ((np.eye(q) - E @ N) @ (since.decay.T @ c)))
    return Constants(known.constants + moved, rates, c, -(acts @ E))


def gain_now(known: AtSample, since: Since, forgetting: Array, floor: Array) -> Array:
    """Adaptation gain R, shape (m, m): that of all constants, held or not.

    Args:
        known: at the sample. since: what has happened. forgetting: rate [1/s]. floor: one over the largest gain.
    """
    m = known.R.shape[0]
    acts = known.R @ known.seen.T
    R = known.R - acts @ _faded(since.fade, known.seen @ acts) @ acts.T
    grown = np.exp(forgetting * since.elapsed)
    return grown * (R @ np.linalg.inv(np.eye(m) + floor * (grown - 1.0) * R))


def excitation_now(known: AtSample, since: Since, window: Array) -> Array:
    """Mean of ``chi' chi`` over a fading window, shape (m, m), to the second order of the time since the sample.

    Args:
        known: at the sample. since: what has happened. window: [s].
    """
    half = np.exp(-0.5 * since.elapsed / window)
    return half * (half * known.excitation + known.seen.T @ since.fade @ known.seen / window)


def covariance_now(known: AtSample, since: Since, by_innovation: Array, sizes: Sizes) -> Array:
    """Covariance of the errors ``(eta, rhoh - rho, c)``, shape (n + m + q, n + m + q).

    Args:
        known: at the sample. since: what has happened. by_innovation: see `Constants`. sizes: see there.
    """
    n, m, q = sizes[:3]
    c_by_c = since.decay @ (np.eye(q) + known.seen @ by_innovation)
    moved = np.vstack(
        [
            np.hstack([since.own, -since.forced @ known.seen, since.forced]),
            np.hstack([np.zeros((m, n)), np.eye(m), by_innovation]),
            np.hstack([np.zeros((q, n + m)), c_by_c]),
        ]
    )
    rest = np.zeros((m + q, n + m + q))
    return moved @ known.covariance @ moved.T + np.vstack([np.hstack([since.noise, np.zeros((n, m + q))]), rest])


def since_flow(since: Since, gain: Array, drift: Array, C: Array, noise: Array) -> Since:
    """Derivatives of what happens between samples.

    Args:
        since: see there. gain: ``inv(S) C'``, shape (n, q). drift: A, shape (n, n). C: shape (q, n). noise: intensity
            of the disturbances of the states, shape (n, n).
    """
    spread = drift @ since.noise
    return Since(
        1.0,
        -((C @ gain) @ since.decay),
        since.decay.T @ since.decay,
        drift @ since.own,
        drift @ since.forced - gain @ since.decay,
        spread + spread.T + noise,
    )


def covariance_at_sample(V: Array, C: Array, row: int, sensitivity: Array, variance: Array, sizes: Sizes) -> Array:
    """Covariance after one measurement, which sets a component of c to ``C xh - y``.

    Args:
        V: before it. C: shape (q, n). row: of the measurement. sensitivity: ``C lambda`` of that row, shape (m,).
            variance: of its noise, in units of its weight. sizes: see there.
    """
    n, m = sizes[:2]
    rows = [[float(i == j) for j in range(sizes.error)] for i in range(sizes.error)]
    place = n + m + row
    rows[place] = [*(C[row, j] for j in range(n)), *(sensitivity[j] for j in range(m)), *([0.0] * sizes.q)]
    jump = np.vstack([np.hstack(r) for r in rows])
    added = np.zeros((sizes.error, sizes.error))
    added[place, place] = 1.0
    return jump @ V @ jump.T + variance * added


def covariance_at_first(V: Array, state: int, row: int, variance: Array, sizes: Sizes) -> Array:
    """Covariance where an estimate has been set to its first measurement, so that its c and sensitivities are zero.

    Args:
        V: before it. state: that has been set. row: of the measurement. variance: of the state now. sizes: see there.
    """
    kept, added = np.eye(sizes.error), np.zeros((sizes.error, sizes.error))
    for place in (state, sizes.n + sizes.m + row):
        kept[place, place] = 0.0
    added[state, state] = 1.0
    return kept @ V @ kept + variance * added


def state_covariance(V: Array, sensitivity: Array, sizes: Sizes) -> Array:
    """Covariance of ``(xh - x, rhoh - rho)``, shape (n + m, n + m).

    Args:
        V: see `covariance_now`. sensitivity: lambda, shape (n, m). sizes: see there.
    """
    n, m = sizes[:2]
    mapped = np.vstack([np.hstack([np.eye(n), sensitivity]), np.hstack([np.zeros((m, n)), np.eye(m)])])
    return mapped @ V[: n + m, : n + m] @ mapped.T


def _faded(W: Array, N: Array) -> Array:
    """``inv(I + W N) W``."""
    return np.linalg.inv(np.eye(W.shape[0]) + W @ N) @ W
