"""The sampled error: how an estimation error moves from one balise to the next, exactly.

Between balises ``de = drift e - gain c``, ``dc = -decay c``, and at a balise ``c = C e`` with C the first unit row. One
matrix exponential gives the transition over a gap; no bound, no approximation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fmu_observer.certificates.gap_error import GeneratorError
from fmu_observer.certificates.impulsive_error import ImpulsiveError


@dataclass(frozen=True)
class SampledError(GeneratorError):
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

    @cached_property
    def reset(self) -> np.ndarray:
        """``[[I, 0], [C, 0]]``: the errors stay and the innovation is set anew, shape (n + 1, n + 1)."""
        matrix = np.eye(self.size + 1)
        matrix[-1] = np.eye(self.size + 1)[0]
        return matrix

    def moved(self, generator: np.ndarray) -> ImpulsiveError:
        """The same reset with another generator, shape (n + 1, n + 1)."""
        return ImpulsiveError.of(generator, self.reset)

    @property
    def continuous_limit(self) -> np.ndarray:
        """Error matrix for infinitely frequent balises, ``drift - gain C``, shape (n, n)."""
        n = self.size
        matrix = self.generator[:n, :n].copy()
        matrix[:, 0] -= np.asarray(self.gain)
        return matrix

    def close(self, exponentials: np.ndarray) -> np.ndarray:
        """Exponentials of shape (count, n + 1, n + 1) as transitions of shape (count, n, n).

        Args:
            exponentials: of the generator, see `GapError`.
        """
        n = self.size
        closed = exponentials[:, :n, :n].copy()
        closed[:, :, 0] += exponentials[:, :n, n]  # the innovation starts as the first error component
        return closed
