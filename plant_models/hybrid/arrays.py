"""What equations are written with: arrays, numbers or symbols alike. NumPy only."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

Array = Any  # a NumPy array, or a symbolic array with NumPy's shapes and broadcasting
NUMBERS = frozenset((float, np.float64))


def vector(*components: Array) -> Array:
    """Stack scalars (or batches of them) into a vector, broadcasting constants.

    Args:
        components: n scalars, or arrays of one common shape ``(members,)``; plain numbers are broadcast.

    Returns:
        Array of shape (n,), or (n, members) for a batch.
    """
    if components and NUMBERS.issuperset(map(type, components)):
        return np.array(components)  # the same numbers; states of thousands are stacked ten times as slowly
    if all(getattr(c, "ndim", 0) == 0 for c in components):
        return np.stack([np.asarray(c) if isinstance(c, int | float) else c for c in components])
    return np.stack(np.broadcast_arrays(*components))


def of_length(values: Array, count: int, what: str) -> Array:
    """The values, if they are as many as expected: a vector of one element would be broadcast in silence.

    Args:
        values: shape (count,), or (count, members) for a batch. count: as many. what: where they come from.

    Raises:
        TypeError: they are no array. ValueError: they are fewer or more.
    """
    if not getattr(values, "shape", ()):
        expected = f"expected an array of {count} values, as of vector(...)"
        raise TypeError(f"{what} returns a {type(values).__name__}; {expected}.")
    if values.shape[0] != count:
        raise ValueError(f"{what} returns {values.shape[0]} values, expected {count}.")
    return values


def matrix(*rows: Sequence[Array]) -> Array:
    """Stack rows of scalars (or batches of them) into a matrix.

    Args:
        rows: n of them, of m entries each; in a batch each row has one entry at least of shape ``(members,)``.

    Returns:
        Array of shape (n, m), or (n, m, members) for a batch.
    """
    return np.stack([vector(*row) for row in rows])


def indicator(condition: Array) -> Array:
    """1 where a condition holds, else 0.

    Args:
        condition: truth values, or symbols of them.
    """
    return np.where(condition, 1.0, 0.0)
