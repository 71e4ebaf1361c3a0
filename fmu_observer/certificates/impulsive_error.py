"""The impulsive error: whatever flows linearly between samples and is reset linearly at them, seen from sample to
sample.

``d zeta = G zeta`` between samples, ``zeta+ = R zeta`` at them. What a reset forgets (a held innovation, a predicted
output) does not count from sample to sample: the transition is reduced to the range of R.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fmu_observer.certificates.gap_error import GapError, GeneratorError, Rows, matrix_powers, rows_of
from fmu_observer.certificates.matrix_exponential import small_exponential

_NEGLIGIBLE = 1e-12  # relative: a smaller pivot of the reset is rounding


@dataclass(frozen=True)
class ImpulsiveError(GeneratorError):
    """Error equations ``d zeta = generator zeta``, ``zeta+ = reset zeta`` at samples; a hashable value.

    With ``reset = U V`` (rank factorisation, V the reduced row echelon form, so that its coordinates are components of
    zeta) the transition over a gap is ``V exp(G gap) U``: it has the non-zero eigenvalues of ``exp(G gap) R``.

    Attributes:
        generator_rows: G, rows of shape (N, N) [1/s]. reset_rows: R, rows of shape (N, N).
        levels: how many times each component of zeta is differentiated against the first, shape (N,): its size grows
            with that power of the rate. For scaling alone; () for none.
    """

    generator_rows: Rows
    reset_rows: Rows
    levels: tuple[int, ...] = ()

    @classmethod
    def of(cls, generator: np.ndarray, reset: np.ndarray, levels: tuple[int, ...] = ()) -> ImpulsiveError:
        """From two square matrices of one size.

        Raises:
            ValueError: the shapes do not agree, or the reset forgets everything.
        """
        G, R = np.asarray(generator, dtype=float), np.asarray(reset, dtype=float)
        if G.ndim != 2 or G.shape[0] != G.shape[1] or G.shape != R.shape:
            raise ValueError(
                f"Impulsive error: generator {G.shape} and reset {R.shape} must be square and of one size."
            )
        if levels and len(levels) != len(G):
            raise ValueError(f"Impulsive error: {len(levels)} levels for {len(G)} components.")
        if not np.abs(R).max() > 0.0:
            raise ValueError(
                "Impulsive error: the reset is zero, every sample ends all errors; there is nothing to certify."
            )
        return cls(rows_of(G), rows_of(R), tuple(levels))

    @classmethod
    def with_innovation(
        cls, drift: np.ndarray, gain: np.ndarray, decay: np.ndarray, C: np.ndarray, levels: tuple[int, ...] = ()
    ) -> ImpulsiveError:
        """``de = drift e - gain c``, ``dc = -decay c``, ``c = C e`` at a sample: a sampled innovation of q components.

        Args:
            drift: shape (n, n). gain: shape (n, q). decay: shape (q, q), zero for a held one. C: shape (q, n).
            levels: of the n components of e.
        """
        n, q = np.shape(gain)
        generator = np.block([[drift, -np.asarray(gain)], [np.zeros((q, n)), -np.asarray(decay)]])
        reset = np.block([[np.eye(n), np.zeros((n, q))], [np.asarray(C), np.zeros((q, q))]])
        return cls.of(generator, reset, (*levels, *(0,) * q) if levels else ())

    @cached_property
    def generator(self) -> np.ndarray:
        """G, shape (N, N)."""
        return np.asarray(self.generator_rows)

    @cached_property
    def reset(self) -> np.ndarray:
        """R, shape (N, N)."""
        return np.asarray(self.reset_rows)

    def moved(self, generator: np.ndarray) -> ImpulsiveError:
        """The same reset with another generator, shape (N, N)."""
        return ImpulsiveError.of(generator, self.reset)

    def courses(self, longest: float, count: int) -> np.ndarray:
        """zeta within a gap from what the reset before it read, shape (count + 1, N, n).

        Args:
            longest: end of the gap [s]. count: equidistant instants after 0.
        """
        powers = matrix_powers(small_exponential(self.generator * longest / count), count)
        return np.asarray(np.concatenate([np.eye(len(self.generator))[None], powers]) @ self.spread)

    @property
    def size(self) -> int:
        """Rank of the reset: the number of components that count from sample to sample, n."""
        return len(self._pivots)

    @cached_property
    def kept(self) -> np.ndarray:
        """V, shape (n, N): what a reset reads."""
        return self._echelon[0]

    @cached_property
    def spread(self) -> np.ndarray:
        """U, shape (N, n): how a reset sets zeta from what it read."""
        return self.reset[:, self._pivots]

    @cached_property
    def continuous_limit(self) -> np.ndarray | None:
        """``V G U`` where a repeated reset changes nothing (``V U = I``), else None: infinitely many resets act at
        once.
        """
        repeated = self.kept @ self.spread
        if np.abs(repeated - np.eye(self.size)).max() > 1e-9:
            return None
        return np.asarray(self.kept @ self.generator @ self.spread)

    @property
    def rate(self) -> float:
        """Natural rate [1/s]: of the continuous limit, and where there is none of the generator."""
        if self.continuous_limit is not None:
            return super().rate
        return max(float(np.abs(np.linalg.eigvals(self.generator)).max()), 1e-9)

    def units(self, rate: float) -> np.ndarray:
        """Size of the kept components relative to the first, by their levels, shape (n,)."""
        if not self.levels:
            return np.ones(self.size)
        return np.asarray(rate ** np.asarray(self.levels, dtype=float)[self._pivots])

    def comparable(self, other: GapError) -> bool:
        """Whether both resets read the same of zeta.

        Args:
            other: the error equation to compare with.
        """
        return (
            isinstance(other, ImpulsiveError)
            and self.kept.shape == other.kept.shape
            and np.allclose(self.kept, other.kept)
        )

    def close(self, exponentials: np.ndarray) -> np.ndarray:
        """Exponentials of shape (count, N, N) as transitions ``V exp U`` of shape (count, n, n).

        Args:
            exponentials: of the generator, see `GapError`.
        """
        return np.asarray(self.kept @ exponentials @ self.spread)

    @property
    def _pivots(self) -> list[int]:
        return self._echelon[1]

    @cached_property
    def _echelon(self) -> tuple[np.ndarray, list[int]]:
        return _row_echelon(self.reset)


def _row_echelon(matrix: np.ndarray) -> tuple[np.ndarray, list[int]]:
    """Reduced row echelon form with its zero rows left out, and the columns of its pivots.

    Args:
        matrix: shape (N, M), not zero.

    Returns:
        Array of shape (rank, M) whose pivot columns are unit vectors, and the pivot columns.
    """
    rows = np.array(matrix, dtype=float)
    negligible = _NEGLIGIBLE * np.abs(rows).max()
    pivots: list[int] = []
    for column in range(rows.shape[1]):
        first = len(pivots)
        if first == len(rows):
            break
        best = first + int(np.abs(rows[first:, column]).argmax())
        if abs(rows[best, column]) <= negligible:
            continue
        rows[[first, best]] = rows[[best, first]]
        rows[first] /= rows[first, column]
        others = np.arange(len(rows)) != first
        rows[others] -= np.outer(rows[others, column], rows[first])
        pivots.append(column)
    return rows[: len(pivots)], pivots
