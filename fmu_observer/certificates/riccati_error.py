"""The error of an observer whose gain comes from a Riccati equation, settled at a constant gap, seen from sample to
sample.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import scipy

from fmu_observer.certificates.gap_error import GapError, Rows, matrix_powers, rows_of
from fmu_observer.certificates.matrix_exponential import small_exponential

_DOUBLINGS = 40
_SETTLED = 1e-12  # relative change of a doubling step


@dataclass(frozen=True)
class RiccatiError(GapError):
    """``de = drift e`` between samples, ``e+ = (I - K C) e`` at them, K settled at the gap itself; a hashable value.

    K is that of ``dP = F P + P F' + Q``, ``inv(P+) = inv(P-) + gap C' inv(R) C`` when every gap is the same: the
    solution of a discrete Riccati equation, for all gaps at once by the doubling algorithm. For ``gap -> 0`` it is that
    of the continuous one.

    Attributes:
        drift: rows of shape (n, n) [1/s], how the error really moves. believed: F, rows of shape (n, n) [1/s], how the
            observer thinks it moves. C: rows of shape (q, n).
        Q: rows of shape (n, n). R: rows of shape (q, q).
        levels: as of `ImpulsiveError`.
    """

    drift: Rows
    believed: Rows
    C: Rows
    Q: Rows
    R: Rows
    levels: tuple[int, ...]

    @classmethod
    def of(
        cls,
        drift: np.ndarray,
        believed: np.ndarray,
        C: np.ndarray,
        Q: np.ndarray,
        R: np.ndarray,
        levels: tuple[int, ...],
    ) -> RiccatiError:
        """From arrays."""
        return cls(rows_of(drift), rows_of(believed), rows_of(C), rows_of(Q), rows_of(R), levels)

    @property
    def size(self) -> int:
        """Number of error components, n."""
        return len(self.drift)

    @cached_property
    def continuous_limit(self) -> np.ndarray:
        """``drift - P C' inv(R) C`` with P of the continuous Riccati equation, shape (n, n)."""
        F, C, Q, R = (np.asarray(rows) for rows in (self.believed, self.C, self.Q, self.R))
        P = scipy.linalg.solve_continuous_are(F.T, C.T, Q, R)
        return np.asarray(np.asarray(self.drift) - P @ C.T @ np.linalg.solve(R, C))

    def units(self, rate: float) -> np.ndarray:
        """Size of the error components relative to the first, by their levels, shape (n,)."""
        return np.asarray(rate ** np.asarray(self.levels, dtype=float))

    def transition(self, gap: float) -> np.ndarray:
        """Error just before the next sample from the error just before this one, at a constant gap, shape (n, n)."""
        return np.asarray(self.transitions(gap, 1)[1][0])

    def transitions(self, longest: float, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Transitions at `count` equidistant constant gaps in (0, longest]: gaps (count,), matrices (count, n, n)."""
        corrections = _corrections(self.believed, self.C, self.Q, self.R, longest, count)
        with np.errstate(over="ignore", invalid="ignore"):
            flows = matrix_powers(small_exponential(np.asarray(self.drift) * (longest / count)), count)
            return longest / count * np.arange(1, count + 1), flows @ corrections


@lru_cache(maxsize=32)
def _corrections(believed: Rows, C_rows: Rows, Q_rows: Rows, R_rows: Rows, longest: float, count: int) -> np.ndarray:
    """``I - K C`` settled at each of `count` gaps, shape (count, n, n)."""
    F, C, R = np.asarray(believed), np.asarray(C_rows), np.asarray(R_rows)
    gaps = longest / count * np.arange(1, count + 1)
    flows = matrix_powers(small_exponential(F * (longest / count)), count)
    noises = _noises(F, np.asarray(Q_rows), flows, longest / count)
    information = gaps[:, None, None] * (C.T @ np.linalg.solve(R, C))
    P = _settled(flows, information, noises)
    with np.errstate(over="ignore", invalid="ignore"):
        return _inverses(np.eye(len(F)) + P @ information)  # I - K C = inv(I + P C' inv(R/gap) C)


def _inverses(matrices: np.ndarray) -> np.ndarray:
    """Inverses, shape (count, n, n); NaN for a gap over which the error leaves the range of numbers."""
    sizes = np.linalg.det(matrices)
    usable = np.isfinite(sizes) & (sizes != 0.0)
    inverses = np.full_like(matrices, np.nan)
    inverses[usable] = np.linalg.inv(matrices[usable])
    return inverses


def _settled(flows: np.ndarray, information: np.ndarray, noises: np.ndarray) -> np.ndarray:
    """P just before a sample, of ``P = Phi inv(inv(P) + G) Phi' + Qd``, by doubling, shape (count, n, n)."""
    A, G, H = np.swapaxes(flows, 1, 2), information, noises
    identity = np.eye(A.shape[1])
    with np.errstate(over="ignore", invalid="ignore"):
        for _ in range(_DOUBLINGS):
            closed = _inverses(identity + G @ H)
            left = A @ closed
            grown = H + np.swapaxes(A, 1, 2) @ H @ closed @ A
            G = G + left @ G @ np.swapaxes(A, 1, 2)
            A = left @ A
            change = (np.abs(grown - H).max(axis=(1, 2)) / np.abs(grown).max(axis=(1, 2))).max()
            H = 0.5 * (grown + np.swapaxes(grown, 1, 2))
            if change < _SETTLED:
                break
    return H


def _noises(F: np.ndarray, Q: np.ndarray, flows: np.ndarray, step: float) -> np.ndarray:
    """``int_0^(k step) exp(F s) Q exp(F' s) ds`` for k = 1 .. count, shape (count, n, n); one step by Van Loan's
    exponential.

    The rest follows from ``Q(a + b) = Q(b) + exp(F b) Q(a) exp(F' b)``, which stays accurate where a long exponential
    would not.
    """
    n = len(F)
    both = small_exponential(np.block([[-F, Q], [np.zeros((n, n)), F.T]]) * step)
    noises = np.empty_like(flows)
    noises[0] = flows[0] @ both[:n, n:]
    filled, count = 1, len(flows)
    with np.errstate(over="ignore", invalid="ignore"):
        while filled < count:
            more, flow = min(filled, count - filled), flows[filled - 1]
            noises[filled : filled + more] = noises[filled - 1] + flow @ noises[:more] @ flow.T
            filled += more
    return noises
