"""Independent samples: how long gaps may be when every measurement comes at its own instants, by a small-gain
condition.

A predicted sample whose error is reset to zero at its own instants is the integral of its error rate since then. As an
operator on signals of finite energy this integral has at most the gain ``2 gap / pi`` (Mirkin, IEEE TAC 2007, by
Wirtinger's inequality), whatever the instants of the others do.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf, pi

import numpy as np

from fmu_observer.certificates.finding import Finding

_FREQUENCIES = 2000
_SPAN = 1e3  # the grid reaches from the slowest rate over this to the fastest times this
_WIDTHS = np.linspace(-2.0, 2.0, 21)  # half widths about each resonance at which the grid is denser
_SAFETY = 1.001  # on the peak of the grid; that nothing exceeds it is then checked
_RAISES = 400  # times the bound is raised until the check confirms it


def independent_gap_limit(A: np.ndarray, B: np.ndarray, C: np.ndarray, D: np.ndarray) -> float:
    """Gap below which ``dz = A z + B w``, ``dw = C z + D w``, every w_i reset to zero at its own instants, is stable.

    With ``v = C z + D w`` and ``w = Delta v``, ``|Delta_i| <= 2 gap / pi``, it is stable where the peak gain of
    ``C inv(s I - A) B + D`` is below ``pi / (2 gap)``; the peak is the least over diagonal scalings of a few steps.
    Sufficient, not necessary: the true limit may be longer.

    Args:
        A: Hurwitz, shape (r, r). B: shape (r, m). C: shape (m, r). D: shape (m, m).

    Returns:
        The gap [s]; 0 if A is not Hurwitz, inf if nothing couples back.
    """
    poles = np.linalg.eigvals(A)
    rates = np.abs(poles)
    if not poles.real.max() < 0.0:
        return 0.0
    resonances = np.abs(poles.imag[:, None] + _WIDTHS * poles.real[:, None]).ravel()
    frequencies = np.r_[0.0, np.geomspace(rates.min() / _SPAN, rates.max() * _SPAN, _FREQUENCIES), resonances]
    shifted = 1j * frequencies[:, None, None] * np.eye(len(A)) - A
    responses = C @ np.linalg.solve(shifted, np.broadcast_to(B.astype(complex), (len(frequencies), *B.shape))) + D
    peak, scale = _scaled_peak(np.concatenate([responses, D[None]]))
    if peak == 0.0:
        return inf
    bound = _confirmed(A, B * scale[None, :], C / scale[:, None], D * scale[None, :] / scale[:, None], _SAFETY * peak)
    return pi / (2.0 * bound)


def with_independent_samples(found: Finding, limit: float) -> Finding:
    """A finding of samples that come together, for samples that come each at their own instants.

    Args:
        found: of samples that come together. limit: as `independent_gap_limit` gives it [s].
    """
    text = f"samples each at their own instants are covered up to gaps of {limit:.4g} s, by a small-gain condition"
    assert found.demand is not None, "a finding about a gap"
    what = "gap between samples at their own instants"
    own = Finding(what, limit, "s", "sufficient", "small-gain condition", found.demand < limit, text)
    return (found if limit >= found.value else replace(found, value=limit, kind="sufficient")).also(own)


def _confirmed(A: np.ndarray, B: np.ndarray, C: np.ndarray, D: np.ndarray, bound: float) -> float:
    """The bound, raised until the peak gain is below it; inf where that cannot be confirmed.

    The gain reaches the bound at a frequency w exactly if i w is an eigenvalue of the Hamiltonian matrix (Boyd,
    Balakrishnan, Kabamba, Math. Control Signals Syst. 2 (1989) 207-219).
    """
    for _ in range(_RAISES):
        inside = np.linalg.inv(bound**2 * np.eye(D.shape[1]) - D.T @ D)
        drift = A + B @ inside @ D.T @ C
        outward = C.T @ (np.eye(len(D)) + D @ inside @ D.T) @ C
        hamiltonian = np.block([[drift, B @ inside @ B.T], [-outward, -drift.T]])
        values = np.linalg.eigvals(hamiltonian)
        rounding = 1e-8 * np.abs(values) + 1e-13 * np.linalg.norm(hamiltonian, 2)
        if np.all(np.abs(values.real) > rounding):
            return bound
        bound *= 1.0 + 10.0 * (_SAFETY - 1.0)
    return inf


def _scaled_peak(responses: np.ndarray) -> tuple[float, np.ndarray]:
    """Least peak of the largest singular value of ``inv(S) H S`` that a few sweeps over diagonal S find, and S; any
    will do.
    """
    scale = np.ones(responses.shape[1])
    best = _peak(responses, scale)
    for factor in (4.0, 2.0, 1.4, 1.1, 1.03):
        improved = True
        while improved:
            improved = False
            for i in range(1, len(scale)):
                for step in (factor, 1.0 / factor):
                    tried = scale.copy()
                    tried[i] *= step
                    value = _peak(responses, tried)
                    if value < best * (1.0 - 1e-6):
                        scale, best, improved = tried, value, True
    return best, scale


def _peak(responses: np.ndarray, scale: np.ndarray) -> float:
    scaled = responses * (scale[None, :] / scale[:, None])
    return float(np.linalg.norm(scaled, 2, axis=(1, 2)).max())
