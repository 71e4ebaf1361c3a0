"""Modes that no measurement sees, by the staircase of the pair (A, C), which is the Popov-Belevitch-Hautus test made
safe.

A mode is unobservable when an eigenvector of A lies in the kernel of C: ``rank [lambda I - A; C] < n`` (Hautus 1969).
With computed eigenvalues this fails where they are repeated, as in every chain of integrators; the staircase finds the
unobservable subspace by orthogonal steps first (Paige 1981) and needs the eigenvalues in it only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fmu_observer.observability.measured_system import MeasuredSystem

_RANK_TOLERANCE = 1e-11
"""Singular values below this share of the norm of A, or of C, count as zero."""

ROUNDING = 1e-13
"""What rounding may leave of a zero, relative to the size of what could stand there: about 450 units in the last place.

A subspace that follows from a smallest singular value s of a matrix of norm m is turned by rounding by about m / s
times as much (Wedin's theorem on the angles of singular subspaces, 1972)."""

_PART = 1e-6
"""A state takes part in a mode when its entry is at least this share of the largest."""


class UnobservableError(ValueError):
    """The measurements do not determine the states; the message says which mode.

    Args:
        message: for the user. modes: those that are not seen.
    """

    def __init__(self, message: str, modes: Sequence[Mode] = ()) -> None:
        super().__init__(message)
        self.modes = tuple(modes)


@dataclass(frozen=True, eq=False)
class Mode:
    """A mode that is not seen.

    Attributes:
        eigenvalue: [1/s], or factor by step [1]; of a conjugate pair the one with positive imaginary part.
        vector: its eigenvector in the units of the states, largest entry (relative to the scales) real and positive,
        shape (n,).
        states: names of the states, in the order of `vector`.
        shares: sizes of the entries relative to the scales, the largest 1, shape (n,).
        chain: 1 for an eigenvector; 2 or more for a direction that moves into the one before it in a chain of
            integrators, and so grows as t.
        step: length of the step [s] of which the eigenvalue is the factor; 0 in continuous time.
    """

    eigenvalue: complex
    vector: np.ndarray
    states: tuple[str, ...]
    shares: np.ndarray
    chain: int = 1
    step: float = 0.0

    @property
    def taking_part(self) -> dict[str, complex]:
        """The states that take part, with their entries."""
        return {name: self.vector[i] for i, name in enumerate(self.states) if self.shares[i] >= _PART}

    @property
    def exponent(self) -> complex:
        """The eigenvalue in continuous time [1/s]; of a factor by step the slowest one that gives it."""
        if not self.step:
            return self.eigenvalue
        return complex(np.log(self.eigenvalue)) / self.step if self.eigenvalue else complex(-np.inf)

    @property
    def decays(self) -> bool:
        """Whether the mode dies out by itself; an offset does not."""
        return bool(self.exponent.real < 0.0)

    def explain(self) -> str:
        """The mode in words: eigenvalue, period, time constant, states."""
        rate, frequency = self.exponent.real, self.exponent.imag
        words = [f"period {2.0 * np.pi / abs(frequency):.4g} s"] if frequency else []
        if np.isinf(rate):
            words.append("gone after a step")
        elif rate:
            words.append(f"{'decays' if rate < 0.0 else 'grows'} with time constant {1.0 / abs(rate):.4g} s")
        elif not frequency:
            words.append("an offset that stays" if self.chain == 1 else "an offset that others integrate")
        value = f"{self.eigenvalue.real:.4g}" + (f" +- {self.eigenvalue.imag:.4g}i" if self.eigenvalue.imag else "")
        unit = "" if self.step else " 1/s"
        parts = ", ".join(f"{name} ({self.shares[self.states.index(name)]:.3g})" for name in self.taking_part)
        return f"eigenvalue {value}{unit} ({', '.join(words) or 'neither decays nor grows'}), in the states {parts}"


def unobservable_modes(system: MeasuredSystem, tolerance: float = _RANK_TOLERANCE) -> list[Mode]:
    """Modes that no measurement of the system sees, however often it is taken.

    Args:
        system: the matrices; a sampled measurement counts like a continuous one. tolerance: for ranks, relative.

    Returns:
        The modes, the least stable first; one of each conjugate pair.
    """
    scaled = system.scaled()
    A = scaled.A - np.eye(len(scaled.A)) if system.step else scaled.A  # what changes; an offset has the eigenvalue zero
    basis = unobservable_subspace(A, scaled.C, tolerance).basis
    if not basis.shape[1]:
        return []
    inner = basis.T @ A @ basis
    values, vectors = np.linalg.eig(inner)
    norm = _norm(A)  # what rounding in `inner` is relative to; `inner` itself may be nothing but rounding
    zeros = _zero_cluster(values, norm)
    chains = _integrators(inner / (norm or 1.0), len(zeros), tolerance)
    modes = [_mode(system, 0j, basis @ column, place) for column, place in chains]
    for i in set(range(len(values))) - set(zeros):
        value = _without_rounding(complex(values[i]), tolerance * norm)
        if value.imag >= 0.0:
            modes.append(_mode(system, value, basis @ vectors[:, i]))
    return sorted(modes, key=lambda mode: -mode.exponent.real)


def undetectable_modes(system: MeasuredSystem, tolerance: float = _RANK_TOLERANCE) -> list[Mode]:
    """The unobservable modes that do not decay by themselves: no observer can make their error vanish.

    Args:
        system: A and C with scales.
        tolerance: below which a singular value counts as zero, relative to the largest.
    """
    return [mode for mode in unobservable_modes(system, tolerance) if not mode.decays]


def require_observable(system: MeasuredSystem) -> None:
    """Refuse a system with a mode that no measurement sees.

    Raises:
        UnobservableError: it has one; the message says which.
    """
    _refuse(system, unobservable_modes(system), "no measurement shows")


def require_detectable(system: MeasuredSystem) -> None:
    """Refuse a system with a mode that no measurement sees and that does not decay.

    Raises:
        UnobservableError: it has one; the message says which.
    """
    _refuse(system, undetectable_modes(system), "no measurement shows, and no decay removes")


@dataclass(frozen=True, eq=False)
class UnobservableSubspace:
    """The largest A-invariant subspace in the kernel of C, as computed.

    Attributes:
        basis: orthonormal, shape (n, k).
        error: how far rounding may have turned it, as the sine of an angle; grows with the conditioning of what was
            measured.
    """

    basis: np.ndarray
    error: float


def unobservable_subspace(A: np.ndarray, C: np.ndarray, tolerance: float = _RANK_TOLERANCE) -> UnobservableSubspace:
    """The unobservable subspace by a staircase of orthogonal steps, with what rounding makes of it.

    Args:
        A: shape (n, n). C: shape (q, n).
        tolerance: below which a singular value counts as zero, relative to the largest.
    """
    basis, inner, seen = np.eye(len(A)), A, C
    size, error = _norm(C), ROUNDING
    while basis.shape[1]:
        _, values, directions = np.linalg.svd(seen) if len(seen) else (None, np.zeros(0), np.eye(len(inner)))
        rank = int(np.sum(values > max(tolerance, error) * size))
        if not rank:
            break
        visible, hidden = directions[:rank].T, directions[rank:].T
        seen, inner, basis = visible.T @ inner @ hidden, hidden.T @ inner @ hidden, basis @ hidden
        error *= size / float(values[rank - 1])
        size = _norm(A)
    return UnobservableSubspace(basis, error)


def _refuse(system: MeasuredSystem, modes: Sequence[Mode], what: str) -> None:
    if modes:
        count = f"{len(modes)} modes that" if len(modes) > 1 else "a mode that"
        listed = "; ".join(mode.explain() for mode in modes)
        raise UnobservableError(
            f"{system.name}: it has {count} {what}: {listed}. Measure one of these states as well.", modes
        )


def _mode(system: MeasuredSystem, value: complex, scaled_vector: np.ndarray, chain: int = 1) -> Mode:
    shares = np.abs(scaled_vector)
    largest = int(np.argmax(shares))
    turned = scaled_vector / scaled_vector[largest]
    vector = turned * system.scales
    if not np.iscomplexobj(vector) or np.abs(vector.imag).max() <= _PART * np.abs(vector).max():
        vector = vector.real
    vector = vector / np.abs(vector[largest])
    eigenvalue = 1.0 + value if system.step else value
    return Mode(eigenvalue, vector, tuple(system.states), shares / shares[largest], chain, system.step)


def _zero_cluster(values: np.ndarray, norm: float) -> list[int]:
    """Indices of eigenvalues that are zero but for rounding, which splits m equal ones by its m-th root around their
    mean.
    """
    order, rounding = np.argsort(np.abs(values)), np.finfo(float).eps
    for count in range(len(values), 0, -1):
        cluster = values[order[:count]]
        split = 10.0 * rounding ** (1.0 / count) * norm
        if np.abs(cluster).max() <= split and abs(cluster.mean()) <= 1e3 * rounding * norm:
            return [int(i) for i in order[:count]]
    return []


def _integrators(inner: np.ndarray, count: int, tolerance: float) -> list[tuple[np.ndarray, int]]:
    """Directions of the eigenvalue zero, each with its place in a chain of integrators; those of the first place are
    constant.
    """
    found: list[tuple[np.ndarray, int]] = []
    power = np.eye(len(inner))
    for place in range(1, count + 1):
        power = power @ inner
        before = np.array([column for column, _ in found]).reshape(-1, len(inner))
        _, values, directions = np.linalg.svd(np.vstack([power, before]))  # orthogonal to what was found before
        kernel = directions[values <= tolerance * max(float(values[0]), 1.0)]
        found += [(column, place) for column in kernel[: count - len(found)]]
    return found


def _without_rounding(value: complex, rounding: float) -> complex:
    real = value.real if abs(value.real) > rounding else 0.0
    return complex(real, value.imag if abs(value.imag) > rounding else 0.0)


def _norm(matrix: np.ndarray) -> float:
    return float(np.linalg.norm(matrix, 2)) if matrix.size else 0.0
