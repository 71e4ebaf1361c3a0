"""How strongly signals reach a residual: the worst disturbance, the weakest fault in a band, pulses. NumPy and SciPy.

Gains are exact: a singular value of the frequency response equals a level at w exactly where i w is an eigenvalue of a
Hamiltonian matrix (Boyd, Balakrishnan, Kabamba 1989), so that no peak is lost between the points of a grid.
"""

from __future__ import annotations

from math import inf, isfinite, sqrt

import numpy as np
import scipy

from fmu_observer.design.residual_channel import ResidualChannel
from fmu_observer.models.checks import check_numbers

_GRID = 400
_SPAN = 1e4  # the grid reaches from the slowest pole over this to the fastest times this
_STEPS = 60  # of the search for a peak; each comes much nearer
_SETTLED, _RESPONSES, _FINEST = 20.0, 500, 0.05  # a step response: time constants, points, part of the fastest one
_LONGEST = 0.5  # of a step times the norm of A, from which intervals are doubled


def h_infinity_norm(channel: ResidualChannel, tolerance: float = 1e-7) -> float:
    """Largest gain from finite energy to finite energy: the peak of the largest singular value over all frequencies.

    ``||r|| <= lambda ||s||`` of Aguiar Cota 2019, (2.25) and (3.48), holds for each lambda that is larger. By level
    sets of the Hamiltonian (Bruinsma, Steinbuch 1990).

    Args:
        channel: from the disturbance to the residual. tolerance: relative.

    Returns:
        The norm; inf where the channel is unstable.
    """
    if not channel.stable:
        return inf
    best = float(_singular(channel, _grid(channel))[:, 0].max())
    for _ in range(_STEPS):
        level = best * (1.0 + tolerance)
        if level == 0.0:
            return 0.0
        crossings = _level_crossings(channel, level)
        if not len(crossings):
            break
        between = _between(np.unique(np.r_[0.0, crossings]))
        higher = float(_singular(channel, np.r_[between, crossings])[:, 0].max())
        if higher <= level:
            break
        best = higher
    return best


def minimum_gain(channel: ResidualChannel, low: float = 0.0, high: float = inf, tolerance: float = 1e-7) -> float:
    """Smallest gain over a band of frequencies: what of a fault in this band reaches the residual at least.

    The H-minus index of Aguiar Cota 2019, (2.25) and (3.51), over a finite band. Over all frequencies it is zero for
    every observer that integrates, since the integrator takes a constant fault for a disturbance.

    Args:
        channel: from the fault to the residual. low, high: ends of the band [rad/s]; high may be inf.
        tolerance: relative.

    Returns:
        The least smallest singular value; 0 where there are more faults than residuals.

    Raises:
        ValueError: the band is not in order.
    """
    if not 0.0 <= low < high or not isfinite(low):
        raise ValueError(f"Minimum gain: the band [{low}, {high}] rad/s must be in order and begin at 0 or above.")
    grid = _grid(channel)
    best = float(_smallest(channel, np.r_[low, grid[(grid > low) & (grid < high)], high]).min())
    for _ in range(_STEPS):
        level = best * (1.0 - tolerance)
        if level <= 0.0:
            return best
        crossings = _level_crossings(channel, level)
        inside = crossings[(crossings > low) & (crossings < high)]
        if not len(inside):
            break
        lower = float(_smallest(channel, _between(np.r_[low, inside, high])).min())
        if lower >= level:
            break
        best = lower
    return best


def bands_above(channel: ResidualChannel, level: float) -> list[tuple[float, float]]:
    """The bands of frequencies in which the gain is at least a level: where a sensitivity gamma really holds.

    Args:
        channel: from the fault to the residual. level: gamma, in units of the residual over the fault.

    Returns:
        Ends of the bands [rad/s], the last one inf where it has no end.

    Raises:
        ValueError: the level is not positive.
    """
    check_numbers("Bands above a level", {"level": level})
    edges = np.r_[0.0, _level_crossings(channel, level), inf]
    bands: list[tuple[float, float]] = []
    for low, high, middle in zip(edges[:-1], edges[1:], _between(edges), strict=True):
        if float(_smallest(channel, np.array([middle]))[0]) >= level:
            joined = bands and bands[-1][1] == low
            bands[-1:] = [(bands[-1][0], float(high))] if joined else [*bands[-1:], (float(low), float(high))]
    return bands


def pulse_ratio(channel: ResidualChannel, length: float, horizon: float = inf) -> float:
    """``||r|| / ||f||`` for a fault of constant size and finite length that begins at rest, both as energies.

    Args:
        channel: from one fault to the residual. length: of the pulse [s]. horizon: until when the residual counts [s]
            from the beginning, at least the length; inf for all of what it leaves behind.

    Returns:
        The ratio in units of the residual over the fault; inf where the channel is unstable and the horizon is not
        finite.

    Raises:
        ValueError: the channel has several signals, the length is not positive, or the horizon is shorter.
    """
    A, B, C, D = channel.matrices
    if B.shape[1] != 1:
        raise ValueError(f"Pulse ratio: the channel has {B.shape[1]} signals, expected one.")
    check_numbers("Pulse ratio", {"length": length})
    if not horizon >= length:
        raise ValueError(f"Pulse ratio: horizon {horizon} s must be at least the length, {length} s.")
    n = len(A)
    whole, seen = np.zeros((n + 1, n + 1)), np.hstack([C, D])
    whole[:n, :n], whole[:n, n:] = A, B
    start = np.eye(n + 1)[n]
    during, transition = _energy(whole, seen, length)
    left = (transition @ start)[:n]
    if isfinite(horizon):
        after = _energy(A, C, horizon - length)[0] if horizon > length else np.zeros((n, n))
    elif channel.stable:
        after = np.asarray(scipy.linalg.solve_continuous_lyapunov(A.T, -C.T @ C))
    else:
        return inf
    return sqrt((start @ during @ start + left @ after @ left) / length)


def minimum_fault(threshold: float, gamma: float) -> float:
    """Smallest fault that a threshold can see, ``threshold / gamma``: Aguiar Cota 2019, 5.3.4. A rule of thumb.

    It takes gamma for the gain of every fault. The gain falls to zero where a fault persists, since the observer's
    integrators take it for a disturbance, and the residual of a fault that grows slowly may never reach the threshold;
    the rule is for faults that begin at once. `bands_above` says for which frequencies a gamma holds, `pulse_ratio` for
    which lengths.

    Args:
        threshold: of the residual. gamma: sensitivity, in units of the residual over the fault.

    Returns:
        The fault, in its unit.

    Raises:
        ValueError: one of them is not positive.
    """
    check_numbers("Minimum fault", {"threshold": threshold, "gamma": gamma})
    return threshold / gamma


def sudden_fault(channel: ResidualChannel, threshold: float, length: float = inf) -> float:
    """Smallest fault of constant size, beginning at once, whose residual reaches a threshold at some instant [ours].

    What a threshold on the size of r really sees, without noise and disturbance: the peak of the residual, not its
    energy. A fault of the sensor shows at its first instant with the whole feedthrough D.

    Args:
        channel: from one fault to one residual, stable. threshold: of the size of r. length: of the fault [s].

    Returns:
        The fault, in its unit; inf where it does not show.

    Raises:
        ValueError: the channel has several signals or residuals or is unstable, or a number is not positive.
    """
    A, B, C, D = channel.matrices
    if D.shape != (1, 1) or not channel.stable:
        raise ValueError(
            f"Sudden fault: the channel has {D.shape[1]} signals and {len(D)} residuals, expected one "
            f"of each and poles in the left half plane, here {channel.poles.tolist()}."
        )
    check_numbers("Sudden fault", {"threshold": threshold})
    if not length > 0.0:
        raise ValueError(f"Sudden fault: the length must be positive, got {length} s.")
    until = min(length, _SETTLED / float(-channel.poles.real.max()))
    step = min(until / _RESPONSES, _FINEST / float(np.abs(channel.poles).max()))
    n = len(A)
    whole = np.zeros((n + 1, n + 1))
    whole[:n, :n], whole[:n, n:] = A, B
    transition = scipy.linalg.expm(whole * step)
    x, peak = np.eye(n + 1)[n], 0.0
    for _ in range(int(until / step) + 1):
        peak = max(peak, abs(float((C @ x[:n])[0] + D[0, 0])))
        x = transition @ x
    return threshold / peak if peak > 0.0 else inf


def _level_crossings(channel: ResidualChannel, level: float) -> np.ndarray:
    """Frequencies at which a singular value of the response equals a level, in order, shape (K,) [rad/s]."""
    A, B, C, D = channel.matrices
    size = np.linalg.norm(D, 2)
    if abs(level - size) <= 1e-12 * size:  # the response tends to it and need not reach it
        level = level * (1.0 + 1e-9)
    inside = np.linalg.inv(level**2 * np.eye(D.shape[1]) - D.T @ D)
    drift = A + B @ inside @ D.T @ C
    outward = C.T @ (np.eye(len(D)) + D @ inside @ D.T) @ C
    hamiltonian = np.block([[drift, level * B @ inside @ B.T], [-outward / level, -drift.T]])
    values = np.linalg.eigvals(hamiltonian)
    near = np.abs(values.real) <= 1e-8 * np.abs(values) + 1e-13 * np.linalg.norm(hamiltonian, 2)
    frequencies = np.sort(np.unique(values.imag[near & (values.imag > 0.0)]))
    if not len(frequencies):
        return frequencies
    hit = np.abs(_singular(channel, frequencies) - level).min(axis=1) <= 1e-4 * level  # rounding near a pole at zero
    return np.asarray(frequencies[hit])


def _singular(channel: ResidualChannel, omega: np.ndarray) -> np.ndarray:
    """Singular values at frequencies, the largest first, shape (K, min(q, k))."""
    return np.asarray(np.linalg.svd(channel.response(omega), compute_uv=False))


def _smallest(channel: ResidualChannel, omega: np.ndarray) -> np.ndarray:
    q, k = channel.D.shape
    return np.zeros(len(omega)) if k > q else _singular(channel, omega)[:, -1]


def _grid(channel: ResidualChannel) -> np.ndarray:
    """Zero, infinity, a geometric grid about the poles, and each resonance."""
    sizes = np.abs(channel.poles)
    sizes = sizes[sizes > 0.0]
    if not len(sizes):
        return np.array([0.0, inf])
    resonances = np.abs(channel.poles.imag)
    about = np.geomspace(sizes.min() / _SPAN, sizes.max() * _SPAN, _GRID)
    return np.asarray(np.r_[0.0, np.sort(np.r_[about, resonances]), inf])


def _between(edges: np.ndarray) -> np.ndarray:
    """A frequency between each pair of neighbours; beyond the last finite one twice that."""
    low, high = edges[:-1], edges[1:]
    return np.where(np.isfinite(high), 0.5 * (low + np.where(np.isfinite(high), high, 0.0)), 2.0 * low + 1.0)


def _energy(A: np.ndarray, C: np.ndarray, length: float) -> tuple[np.ndarray, np.ndarray]:
    """``int exp(A' t) C' C exp(A t) dt`` over [0, length] and ``exp(A length)``, by doubling a short interval."""
    doublings = max(0, int(np.ceil(np.log2(max(float(np.linalg.norm(A, 2)) * length / _LONGEST, 1.0)))))
    n, short = len(A), length / 2**doublings
    block = np.block([[-A.T, C.T @ C], [np.zeros((n, n)), A]])
    exponential = scipy.linalg.expm(block * short)
    transition = exponential[n:, n:]
    energy = transition.T @ exponential[:n, n:]
    for _ in range(doublings):
        energy, transition = energy + transition.T @ energy @ transition, transition @ transition
    return energy, transition
