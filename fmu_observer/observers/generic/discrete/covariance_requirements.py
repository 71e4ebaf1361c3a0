"""What a covariance must fulfil before a filter runs, in words that name the entry. Pure functions that trace."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fmu_observer.formulas.filtering.square_root import factor
from fmu_observer.observers.model_observer import as_matrix
from plant_models.hybrid import Array

ROUNDING = 1e-9  # share of the product of two deviations that is taken for zero
_CARRIED_ROUNDING = 1e-6  # likewise, of a covariance that went through many steps


def positive(name: str, flat: Array, size: int, *, definite: bool) -> dict[str, Array]:
    """Requirements that a covariance is one: symmetric, and positive, entry by entry.

    Args:
        name: of the parameter. flat: its values row by row, shape (size * size,). size: rows.
        definite: whether variances of zero are refused too.

    Returns:
        By text, which names the entry: 1 where it is fulfilled, else 0.
    """
    needed: dict[str, Array] = {}
    matrix = as_matrix(flat, size, size)
    for i in range(size):
        for j in range(i):
            one, other = i * size + j + 1, j * size + i + 1
            text = f"{name}[{one}] and {name}[{other}] must be equal: a covariance is symmetric"
            needed[text] = _small(matrix[i, j] - matrix[j, i], matrix, i, j)
    entries = [f"{name}[{i * (size + 1) + 1}]" for i in range(size)]
    return needed | positive_matrix(name, matrix, entries, definite=definite)


def positive_matrix(name: str, matrix: Array, entries: Sequence[str], *, definite: bool = False) -> dict[str, Array]:
    """Requirements that a symmetric matrix is a covariance, entry by entry.

    Args:
        name: of it. matrix: shape (n, n). entries: names of its diagonal. definite: see `positive`.

    Returns:
        By text, which names the entry: 1 where it is fulfilled, else 0.
    """
    needed: dict[str, Array] = {}
    for i, entry in enumerate(entries):
        legal = matrix[i, i] > 0.0 if definite else matrix[i, i] >= 0.0
        needed[f"{entry} must be {'positive' if definite else 'zero or more'}: it is a variance"] = np.where(
            legal, 1.0, 0.0
        )
    lower = factor(matrix)
    rest = matrix - lower @ lower.T
    kind = "definite" if definite else "semidefinite"
    for i in range(1, len(entries)):
        fits: Array = np.where(lower[i, i] > 0.0, 1.0, 0.0) if definite else 1.0
        for j in range(i + 1):
            fits = fits * _small(rest[i, j], matrix, i, j)
        needed[f"{entries[i]} is too small beside the covariances of its row: {name} must be positive {kind}"] = fits
    return needed


def is_positive(matrix: Array) -> Array:
    """Whether a covariance that a filter carries is one: 1 where it is positive semidefinite, else 0.

    Args:
        matrix: symmetric, shape (n, n).
    """
    lower, fits, size = factor(matrix), 1.0 + 0.0 * matrix[0, 0], matrix.shape[0]
    rest = matrix - lower @ lower.T
    for i in range(size):
        for j in range(i + 1):
            fits = fits * _small(rest[i, j], matrix, i, j, _CARRIED_ROUNDING)
    return fits


def _small(value: Array, matrix: Array, i: int, j: int, rounding: float = ROUNDING) -> Array:
    """1 where a value is rounding beside the deviations of two entries, else 0."""
    return np.where(value * value <= rounding * rounding * np.abs(matrix[i, i] * matrix[j, j]), 1.0, 0.0)
