"""The sampled error: how an estimation error moves from one balise to the next, exactly.

Between balises ``de = drift e - gain c``, ``dc = -decay c``, and at a balise ``c = C e`` with C the first unit row. One matrix
exponential gives the transition over a gap; no bound, no approximation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import inf

import numpy as np

from fmu_observer.certificates.exponential import small_exponential

SCAN_POINTS = 4000
BISECTIONS = 40


@dataclass(frozen=True)
class SampledError:
    """Error equations of an observer with a decaying sampled innovation; a hashable value.

    Attributes:
        drift: error matrix between balises, continuous corrections included, rows of shape (n, n) [1/s].
        gain: gain of the decaying innovation, shape (n,).
        decay: decay rate of the innovation [1/s].
    """

    drift: tuple[tuple[float, ...], ...]
    gain: tuple[float, ...]
    decay: float

    @classmethod
    def of(cls, drift: Sequence[Sequence[float]], gain: Sequence[float], decay: float) -> SampledError:
        """From any sequences of numbers."""
        return cls(tuple(tuple(float(v) for v in row) for row in drift), tuple(float(v) for v in gain), float(decay))

    @property
    def size(self) -> int:
        """Number of error components, n."""
        return len(self.gain)

    @cached_property
    def generator(self) -> np.ndarray:
        """``[[drift, -gain], [0, -decay]]`` of the error with the innovation behind it, shape (n + 1, n + 1)."""
        n = self.size
        matrix = np.zeros((n + 1, n + 1))
        matrix[:n, :n] = self.drift
        matrix[:n, n] = -np.asarray(self.gain)
        matrix[n, n] = -self.decay
        return matrix

    @property
    def continuous_limit(self) -> np.ndarray:
        """Error matrix for infinitely frequent balises, ``drift - gain C``, shape (n, n)."""
        n = self.size
        matrix = self.generator[:n, :n].copy()
        matrix[:, 0] -= np.asarray(self.gain)
        return matrix

    def transition(self, gap: float) -> np.ndarray:
        """Error just before the next balise from the error at this one, Phi(gap), shape (n, n)."""
        return np.asarray(self._close(small_exponential(self.generator * gap)[None])[0])

    def transitions(self, longest: float, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Transitions at `count` equidistant gaps in (0, longest]: gaps of shape (count,), matrices of shape (count, n, n)."""
        step = small_exponential(self.generator * (longest / count))
        powers = np.empty((count, *step.shape))
        powers[0] = step
        filled = 1
        with np.errstate(over="ignore", invalid="ignore"):  # an unstable error may leave the range of numbers
            while filled < count:  # doubling: powers[k + filled] = powers[k] step^filled
                more = min(filled, count - filled)
                powers[filled : filled + more] = powers[:more] @ powers[filled - 1]
                filled += more
        return longest / count * np.arange(1, count + 1), self._close(powers)

    def spectral_radius(self, gap: float) -> float:
        """Factor by which the error grows per balise at a constant gap [1]; stable below 1."""
        return float(np.abs(np.linalg.eigvals(self.transition(gap))).max())

    def _close(self, exponentials: np.ndarray) -> np.ndarray:
        n = self.size
        closed = exponentials[:, :n, :n].copy()
        closed[:, :, 0] += exponentials[:, :n, n]  # the innovation starts as the first error component
        return closed


def first_unstable_gap(vertices: Sequence[SampledError], horizon: float) -> float:
    """First constant gap at which some vertex is unstable, by scanning (0, horizon] and bisection.

    Args:
        vertices: error equations. horizon: longest gap searched [s].

    Returns:
        The gap [s]; 0 if even infinitely frequent balises do not stabilise, inf if no gap up to the horizon is unstable.
    """
    return min(_first_unstable_gap_of(vertex, horizon) for vertex in vertices)


@lru_cache(maxsize=256)
def _first_unstable_gap_of(vertex: SampledError, horizon: float) -> float:
    if np.linalg.eigvals(vertex.continuous_limit).real.max() >= 0.0:
        return 0.0
    gaps, matrices = vertex.transitions(horizon, SCAN_POINTS)
    finite = np.isfinite(matrices).all(axis=(1, 2))
    radii = np.full(len(gaps), inf)
    radii[finite] = np.abs(np.linalg.eigvals(matrices[finite])).max(axis=1)
    unstable = np.flatnonzero(radii >= 1.0)
    if unstable.size == 0:
        return inf
    high = float(gaps[unstable[0]])
    low = high - horizon / SCAN_POINTS
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if vertex.spectral_radius(middle) < 1.0 else (low, middle)
    return high
