"""Where each signal stands in the flat arrays ``x``, ``u``, ``p`` of solvers: from there to a named tuple and back.

A matrix has two dimensions; a symmetric one stands there as its upper triangle, row by row. Equations see names and
shapes alone. It knows signals and NumPy, and nothing of systems.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from plant_models.hybrid.arrays import Array, vector
from plant_models.hybrid.signal import Signal, width

NUMBERS = (int, float, np.generic, np.ndarray)


class _Place(NamedTuple):
    """Where a signal stands.

    Attributes:
        first, end: in the flat array. shape: as the equations see it, () for a scalar. read: places in the flat array
            of all entries of a symmetric matrix, row by row. written: places in the matrix, row by row, of what stands
            in the flat array. Both None where nothing is symmetric.
    """

    first: int
    end: int
    shape: tuple[int, ...]
    read: list[int] | None
    written: list[int] | None


class SignalLayout:
    """The places of some signals, in the order of their declaration.

    Args:
        signals: states, inputs or parameters. kind: which of these, for messages.
    """

    def __init__(self, signals: Sequence[Signal], kind: str = "States") -> None:
        self.signals, self.kind = tuple(signals), kind
        self.width = width(self.signals)
        self._places: dict[str, _Place] = {}
        first = 0
        for signal in self.signals:
            self._places[signal.name] = _place(signal, first)
            first += signal.width

    def named(self, flat: Array) -> Any:
        """Named tuple of the values.

        Args:
            flat: shape (n,), or (n, members) for a batch.

        Returns:
            By name: a scalar as it stands in `flat`; a vector or matrix in its shape, in a batch with the members as
            last dimension.
        """
        return self._type._make(self.values(flat))

    def values(self, flat: Array) -> Iterator[Array]:
        """What `named` gives by name, in order.

        Args:
            flat: see `named`.
        """
        return (_read(flat, place) for place in self._places.values())

    def flat(self, values: Any, what: str, members: tuple[int, ...] = (), before: Array = None) -> Array:
        """The flat array of values by name, shape (n,), or (n, members) for a batch.

        Args:
            values: by name of the state, in its shape; in a batch the members are the last dimension, or one value is
                that of all. what: where they come from, for messages. members: () or (members,).
            before: flat array that keeps what `values` does not name; without it all must be named.

        Raises:
            TypeError: `values` is no mapping. ValueError: a name is unknown, or missing, or a shape is another one.
        """
        if not isinstance(values, Mapping):
            some = ", ".join(f"{name!r}: ..." for name in [*self._places][:2])
            advice = f"expected a dictionary of values by name of the state, {{{some}}}, not one array of all"
            raise TypeError(f"{what} returns a {type(values).__name__}; {advice}.")
        self._check_names(values, what, before is not None)
        parts: list[Array] = []
        for name, place in self._places.items():
            if name in values:
                parts.append(_written(values[name], place, members, f"{what} returns {name!r}"))
            else:
                parts.append(before[place.first : place.end])
        return _joined(parts, [place.end - place.first for place in self._places.values()], members)

    def _check_names(self, values: Mapping[str, Array], what: str, partly: bool) -> None:
        for name in values:
            if name not in self._places:
                near = get_close_matches(name, self._places, 1)
                known = f"did you mean {near[0]!r}" if near else f"it has: {', '.join(self._places) or 'none'}"
                raise ValueError(f"{what} returns {name!r}, which is no state of its kind; {known}.")
        if not partly and len(values) != len(self._places):
            raise ValueError(f"{what} leaves out {', '.join(n for n in self._places if n not in values)}.")

    @cached_property
    def _type(self) -> Any:
        return namedtuple(self.kind, list(self._places))


def _place(signal: Signal, first: int) -> _Place:
    end, shape = first + signal.width, signal.dimensions
    if not signal.symmetric:
        return _Place(first, end, shape, None, None)
    n = shape[0]
    upper = {pair: k for k, pair in enumerate((i, j) for i in range(n) for j in range(i, n))}
    read = [first + upper[min(i, j), max(i, j)] for i in range(n) for j in range(n)]
    return _Place(first, end, shape, read, [i * n + j for i, j in upper])


def _read(flat: Array, place: _Place) -> Array:
    if not place.shape:
        return flat[place.first]
    values = flat[place.first : place.end] if place.read is None else flat[place.read]
    return values if len(place.shape) == 1 else values.reshape((*place.shape, *flat.shape[1:]))


def _written(value: Array, place: _Place, members: tuple[int, ...], what: str) -> Array:
    """The value as it stands in the flat array: a list of one, or an array with one row for each number."""
    shape = tuple(value.shape) if hasattr(value, "shape") else np.shape(value)
    if shape not in (place.shape, place.shape + members):
        expected = f"shape {place.shape}" if place.shape else "one number"
        raise ValueError(f"{what} of shape {shape}; expected {expected}.")
    if not place.shape:
        return [value]
    rows = value if len(place.shape) == 1 else np.reshape(value, (-1, *shape[2:]))
    return rows if place.written is None else rows[place.written]


def _joined(parts: Sequence[Array], widths: Sequence[int], members: tuple[int, ...]) -> Array:
    numbers = all(isinstance(part[0] if isinstance(part, list) else part, NUMBERS) for part in parts if len(part))
    if not numbers:
        return vector(*(part[i] for part, size in zip(parts, widths, strict=True) for i in range(size)))
    rows = [np.asarray(part, dtype=float) for part in parts] or [np.zeros(0)]
    return np.concatenate([np.broadcast_to(_column(row, members), (len(row), *members)) for row in rows])


def _column(row: np.ndarray, members: tuple[int, ...]) -> np.ndarray:
    return row[:, None] if members and row.ndim == 1 else row
