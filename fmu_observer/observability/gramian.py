"""The observability Gramian over a pattern: what the measurements of an actual run show of the state at its start.

``W = int exp(A't) Cc'Cc exp(A t) dt + sum exp(A'tk) Cs'Cs exp(A tk)``; x0' W x0 is the energy of all that is measured.
[ours: the thesis treats observability by rank conditions only]
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, log2

import numpy as np

from fmu_observer.certificates.matrix_exponential import small_exponential
from fmu_observer.observability.measured_system import MeasuredSystem
from fmu_observer.observability.modes import (
    ROUNDING,
    Mode,
    UnobservableError,
    UnobservableSubspace,
    undetectable_modes,
    unobservable_modes,
    unobservable_subspace,
)
from fmu_observer.observability.pattern import SamplePattern

_PATTERN_TOLERANCE = 1e-9
"""Singular values of the measured rows below this share of the largest count as zero."""

_BASE_NORM = 0.5  # of A h, for the step that the doubling starts from


@dataclass(frozen=True, eq=False)
class Observability:
    """What a pattern of measurements shows of the state at its start. All in states divided by their scales.

    Attributes:
        system: the matrices asked about. pattern: the instants.
        gramian: W, shape (n, n).
        singular_values: of W, largest first, shape (n,).
        rank: number of independent directions that are measured; judged on the measurements, not on W, whose singular
            values are their squares.
        unseen: orthonormal basis of the directions that are not measured, shape (n, n - rank).
        remaining: largest factor by which an unseen direction has grown or shrunk at the end of the pattern; 0 without
        any.
        unobservable: modes that no pattern would show. undetectable: those of them that do not decay.
    """

    system: MeasuredSystem
    pattern: SamplePattern
    gramian: np.ndarray
    singular_values: np.ndarray
    rank: int
    unseen: np.ndarray
    remaining: float
    unobservable: tuple[Mode, ...]
    undetectable: tuple[Mode, ...]

    @property
    def observable(self) -> bool:
        """Whether every direction is measured."""
        return self.rank == self.system.order

    @property
    def smallest_singular_value(self) -> float:
        """Smallest singular value of W: the energy of the measurements of the worst state of size one."""
        return float(self.singular_values[-1])

    def explain(self) -> str:
        """One to three sentences for the user."""
        count, n = len(self.pattern.instants), self.system.order
        plural = "" if count == 1 else "s"
        head = (
            f"{self.system.name}: {count} sample{plural} in {self.pattern.duration:.4g} s show {self.rank} of {n} "
            f"states"
        )
        if self.observable:
            return f"{head}; smallest singular value of the Gramian {self.smallest_singular_value:.4g}."
        parts = [self._direction(column) for column in self.unseen.T]
        text = (
            f"{head}; not measured: {'; '.join(parts)}. At the end of the pattern {self.remaining:.2g} of it is left."
        )
        if self.unobservable:
            return f"{text} No pattern would show: {'; '.join(mode.explain() for mode in self.unobservable)}."
        if self.remaining < _PATTERN_TOLERANCE:
            return f"{text} It dies out by itself before the samples come."
        return f"{text} Other instants would show it: these are too few, or in step with an oscillation."

    def require(self) -> None:
        """Refuse a pattern that leaves a direction of the state unmeasured.

        Raises:
            UnobservableError: it does; the message is `explain`.
        """
        if not self.observable:
            raise UnobservableError(self.explain(), self.unobservable)

    def _direction(self, column: np.ndarray) -> str:
        largest = np.abs(column).max()
        named = zip(self.system.states, column, strict=True)
        return " ".join(f"{value / largest:+.3g} {name}" for name, value in named if abs(value) > 1e-6 * largest)


def observability(
    system: MeasuredSystem, pattern: SamplePattern, tolerance: float = _PATTERN_TOLERANCE
) -> Observability:
    """Gramian, rank and unseen directions of a measured system over a pattern.

    Rank and directions are those of the state at the start of the pattern. A mode that dies out before the first sample
    is not measured, and need not be: `remaining` says how much of it is left.

    Args:
        system: the matrices. pattern: instants of its sampled measurements, and how long the continuous ones last.
        tolerance: for the rank, relative.
    """
    scaled = system.scaled()
    gramian = observability_gramian(scaled, pattern)
    unseen = _unseen(scaled, pattern, tolerance)
    remaining = 0.0
    if unseen.shape[1]:
        remaining = float(np.linalg.norm(_transition(scaled.A, pattern.duration) @ unseen, 2))
    return Observability(
        system,
        pattern,
        gramian,
        np.linalg.svd(gramian, compute_uv=False),
        system.order - unseen.shape[1],
        unseen,
        remaining,
        tuple(unobservable_modes(system)),
        tuple(undetectable_modes(system)),
    )


def observability_gramian(system: MeasuredSystem, pattern: SamplePattern) -> np.ndarray:
    """W over a pattern in the units of the states, shape (n, n); from the last interval back to the first.

    Args:
        system: A and C with scales.
    """
    assert isinstance(system.C_continuous, np.ndarray)
    assert isinstance(system.C_sampled, np.ndarray)
    continuous, sampled = system.C_continuous.T @ system.C_continuous, system.C_sampled.T @ system.C_sampled
    found: dict[float, tuple[np.ndarray, np.ndarray]] = {}
    gramian = np.zeros_like(system.A)
    for k, gap in enumerate(reversed(pattern.gaps)):
        if gap not in found:
            found[gap] = _over_gap(system.A, continuous, float(gap))
        transition, integral = found[gap]
        gramian = integral + transition.T @ (gramian + (sampled if k else 0.0)) @ transition
    return np.asarray(0.5 * (gramian + gramian.T))


def _over_gap(A: np.ndarray, weight: np.ndarray, gap: float) -> tuple[np.ndarray, np.ndarray]:
    """``exp(A gap)`` and ``int_0^gap exp(A't) weight exp(A t) dt`` by Van Loan's block, then doubling.

    The block exponential of Van Loan (1978) holds exp(-A' h) too, which leaves the range of numbers over a long gap
    where A is stiff. So it is taken over a short step only.
    """
    n, size = len(A), float(np.abs(A).sum(axis=0).max()) * gap
    doublings = max(0, ceil(log2(size / _BASE_NORM))) if size > 0.0 else 0
    h = gap / 2.0**doublings
    block = small_exponential(np.block([[-A.T, weight], [np.zeros((n, n)), A]]) * h)
    transition = block[n:, n:]
    integral = transition.T @ block[:n, n:]
    for _ in range(doublings):
        integral = integral + transition.T @ integral @ transition
        transition = transition @ transition
    return transition, integral


def _transition(A: np.ndarray, gap: float) -> np.ndarray:
    return small_exponential(A * gap)


def _unseen(scaled: MeasuredSystem, pattern: SamplePattern, tolerance: float) -> np.ndarray:
    """Basis of what neither the continuous measurement, over any interval, nor a sample shows, shape (n, k).

    A measured row that is smaller than what rounding could have made of zero shows nothing.
    """
    assert isinstance(scaled.C_continuous, np.ndarray)
    assert isinstance(scaled.C_sampled, np.ndarray)
    lasting = pattern.duration > 0.0 and len(scaled.C_continuous)
    hidden = (
        unobservable_subspace(scaled.A, scaled.C_continuous)
        if lasting
        else UnobservableSubspace(np.eye(scaled.order), ROUNDING)
    )
    basis = hidden.basis
    if not basis.shape[1]:
        return basis
    inner, rows, moved = basis.T @ scaled.A @ basis, [], np.eye(basis.shape[1])
    for gap in pattern.gaps[:-1]:
        moved = _transition(inner, float(gap)) @ moved
        row = scaled.C_sampled @ basis @ moved
        possible = np.linalg.norm(scaled.C_sampled, axis=1, keepdims=True) * np.linalg.norm(moved, 2)
        rows.append(np.where(np.linalg.norm(row, axis=1, keepdims=True) > hidden.error * possible, row, 0.0))
    if not rows or not rows[0].size:
        return basis
    stacked = np.vstack(rows)
    sizes = np.linalg.norm(stacked, axis=1, keepdims=True)
    weights = np.where(sizes > 0.0, np.maximum(sizes, np.finfo(float).tiny), 1.0)
    _, values, directions = np.linalg.svd(stacked / weights)
    rank = int(np.sum(values > tolerance * max(float(values[0]), np.finfo(float).tiny)))
    return np.asarray(basis @ directions[rank:].T)
