"""Error equations that change within a gap: how far the error may then stray from that of the centre, as a bound on
norms.

The findings of `aperiodic` are about transitions over whole gaps, each with one generator from sample to sample. Where
slopes or weights may move at any time between those of the vertices, the flow is the differential inclusion
``d zeta = (G0 + D(t)) zeta`` with D(t) in the hull of the vertices' distances from the centre G0. Variation of
constants gives the transition as that of the centre plus ``E``, and a Volterra inequality bounds E in the norm of a
Lyapunov matrix.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fmu_observer.certificates.decaying_innovation_error import DecayingError
from fmu_observer.certificates.gap_error import GapError, GeneratorError, matrix_powers
from fmu_observer.certificates.impulsive_error import ImpulsiveError
from fmu_observer.certificates.matrix_exponential import small_exponential

_POINTS = 300  # of the quadrature over the longest gap
_QUADRATURE = 1.01  # on what the trapezoidal rule finds: a hundred times its error where a rate acts ten times in a gap
_NEGLIGIBLE = 1e-12  # relative: a direction in which generators differ less is rounding


@dataclass(frozen=True)
class SwitchingError:
    """The inclusion between the vertices of an error that moves among them at any time.

    Attributes:
        centre: the error in the middle of the vertices, whose course over a gap and whose response to a disturbance
            within it are known.
        distances: generators of the vertices less that of the centre, shape (vertices, N, N) [1/s].
    """

    centre: ImpulsiveError | DecayingError
    distances: np.ndarray

    @classmethod
    def between(cls, vertices: Sequence[GapError]) -> SwitchingError:
        """The inclusion spanned by vertices with one reset, or one decaying correction, in common.

        Raises:
            ValueError: a vertex has no generator of its own, or the resets differ.
        """
        known = [vertex for vertex in vertices if isinstance(vertex, GeneratorError | DecayingError)]
        if len(known) < len(vertices) or len({vertex.moved(known[0].generator) for vertex in known}) > 1:
            raise ValueError(
                "Certificate: changes within a gap are covered only where all vertices flow linearly and share one "
                "reset."
            )
        generators = np.stack([vertex.generator for vertex in known])
        middle = 0.5 * (generators.min(axis=0) + generators.max(axis=0))
        centre = known[0].moved(middle)
        assert isinstance(centre, ImpulsiveError | DecayingError)
        return cls(centre, generators - middle)

    def growth(self, P: np.ndarray, longest: float, gaps: np.ndarray) -> np.ndarray:
        """What changes within the gap add to ``V+ / V`` at most, V the quadratic function of `P`, over the gap [1/s].

        With ``f = |F0|`` and ``e >= |E|`` in the norm of P, ``|F0 + E|^2 <= f^2 + 2 f e + e^2``: the last two, over the
        gap.

        Args:
            P: positive definite, shape (n, n). longest: longest gap [s]. gaps: rising, from 0 to `longest` [s], shape
                (count,).

        Returns:
            Shape (count,); at a gap of zero the limit.
        """
        root = np.linalg.cholesky(P).T
        before = self.centre.spread @ np.linalg.inv(root)
        sizes = np.linalg.norm(before, axis=1)
        sizes = np.where(sizes > 0.0, sizes, 1.0)  # of the components of zeta where V is 1: the scale of their norms
        into, strength, out = _directions(self.distances * (sizes[None, :] / sizes[:, None]))
        if strength == 0.0:
            return np.zeros(len(gaps))
        into, out = sizes[:, None] * into, out / sizes[None, :]
        step = longest / _POINTS
        flow = np.concatenate(
            [np.eye(len(sizes))[None], matrix_powers(small_exponential(self.centre.generator * step), _POINTS)]
        )
        course = self.centre.courses(longest, _POINTS) @ np.linalg.inv(root)
        after = root @ self.centre.kept
        seen = _norms(out @ course)
        kernel, effect = strength * _norms(out @ flow @ into), strength * _norms(after @ flow @ into)
        stray = _QUADRATURE * _convolved(effect, _volterra(seen, kernel, step), step)
        grown = _norms(after @ course)
        added = (2.0 * grown + stray) * stray
        times = step * np.arange(_POINTS + 1)
        rates = np.concatenate([[2.0 * _QUADRATURE * effect[0] * seen[0]], added[1:] / times[1:]])
        return np.asarray(np.interp(gaps, times, rates))


def _directions(distances: np.ndarray) -> tuple[np.ndarray, float, np.ndarray]:
    """Bases B (N, r) and C (q, N) of what distances D of shape (count, N, N) act on and see; the largest
    ``|B' D C'|``.
    """
    into = _basis(np.concatenate(list(distances), axis=1))
    out = _basis(np.concatenate([d.T for d in distances], axis=1)).T
    return into, max((float(np.linalg.norm(into.T @ d @ out.T, 2)) for d in distances if into.size), default=0.0), out


def _basis(matrix: np.ndarray) -> np.ndarray:
    left, values, _ = np.linalg.svd(matrix, full_matrices=False)
    return np.asarray(left[:, values > _NEGLIGIBLE * max(float(values[0]), _NEGLIGIBLE)])


def _norms(matrices: np.ndarray) -> np.ndarray:
    return np.asarray(np.linalg.norm(matrices, 2, axis=(1, 2)))


def _volterra(known: np.ndarray, kernel: np.ndarray, step: float) -> np.ndarray:
    """Solution of ``m(s) = known(s) + int kernel(s - r) m(r) dr`` by the trapezoidal rule, shape (points,)."""
    m = np.empty_like(known)
    m[0] = known[0]
    corner = 1.0 - 0.5 * step * kernel[0]
    for j in range(1, len(m)):
        past = kernel[j:0:-1] @ m[:j] - 0.5 * kernel[j] * m[0]
        m[j] = (known[j] + step * past) / corner if corner > 0.0 else np.inf
    return m


def _convolved(a: np.ndarray, b: np.ndarray, step: float) -> np.ndarray:
    """``int a(s - r) b(r) dr`` by the trapezoidal rule, shape (points,)."""
    with np.errstate(invalid="ignore", over="ignore"):
        return np.asarray(step * (np.convolve(a, b)[: len(a)] - 0.5 * (a * b[0] + a[0] * b)))
