"""Layouts: where balises lie along the track, as parameters of a plant, read without branching on values.

Brings the parameters and reads them; knows the signal vocabulary and nothing of vehicles.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import isfinite
from typing import Any, Protocol

import numpy as np

from plant_models.hybrid import Array, Signal, parameter
from plant_models.hybrid.option import require_whole

UNUSED = 1e30  # [m]; a balise that is not laid lies beyond the end of any track


class BaliseLayout(Protocol):
    """Balises along the track. A direction is 1 (increasing position) or -1; a section contains its end and not its
    start, so that a train that stands on a balise has passed it once.

    Attributes:
        parameters: what the layout needs of the plant's parameters.
    """

    parameters: tuple[Signal, ...]

    def count(self, before: Array, after: Array, direction: Array, p: Any) -> Array:
        """Number of balises passed from one position to another [m] in a direction.

        Args:
            before, after: positions [m]. direction: 1 forwards, -1 backwards.
        """

    def next(self, position: Array, direction: Array, p: Any) -> Array:
        """Position of the first balise beyond a position [m] in a direction; `UNUSED` or more, by magnitude, where none
        is.
        """


class Spacing:
    """Balises at ``first_balise + k * balise_spacing``, k = 0 ... ``balise_total - 1``; none if the spacing is not
    positive.
    """

    parameters: tuple[Signal, ...] = (
        parameter("first_balise", "m", 100.0, "Position of the first balise"),
        parameter("balise_spacing", "m", 100.0, "Distance from one balise to the next", min=1e-3),
        parameter("balise_total", "1", 1000.0, "Number of balises", min=0.0),
    )

    def count(self, before: Array, after: Array, direction: Array, p: Any) -> Array:
        """See `BaliseLayout`."""
        upwards = self._up_to(after, p) - self._up_to(before, p)
        return np.where(direction > 0.0, upwards, self._before(before, p) - self._before(after, p))

    def next(self, position: Array, direction: Array, p: Any) -> Array:
        """See `BaliseLayout`."""
        k = np.where(direction > 0.0, self._up_to(position, p), self._before(position, p) - 1.0)
        laid = np.where(k >= 0.0, np.where(k < _total(p), 1.0, 0.0), 0.0)
        return np.where(laid > 0.0, _place(k, p), direction * UNUSED)

    @staticmethod
    def _up_to(position: Array, p: Any) -> Array:
        """Number of balises at or before a position. The quotient may be off by one through rounding; the places
        decide.
        """
        k = np.floor((position - p.first_balise) / _spacing(p)) + 1.0
        k = k + np.where(_place(k, p) <= position, 1.0, 0.0)
        k = k - np.where(_place(k - 1.0, p) > position, 1.0, 0.0)
        return np.clip(k, 0.0, _total(p))

    @staticmethod
    def _before(position: Array, p: Any) -> Array:
        """Number of balises before a position."""
        k = np.floor((position - p.first_balise) / _spacing(p)) + 1.0
        k = k - np.where(_place(k - 1.0, p) >= position, 1.0, 0.0)
        k = k + np.where(_place(k, p) < position, 1.0, 0.0)
        return np.clip(k, 0.0, _total(p))


class Positions:
    """Balises at the entries of the vector ``positions``, in any order; entries that are not used hold `UNUSED`.

    Entries set to one place at run time are one balise.

    Args:
        size: number of entries.
        positions: start values [m], no more than `size`.
        distinguished: number of crossings in a section up to which entries at one place are recognised; beyond it each
            one counts.

    Raises:
        ValueError: there are too many positions, one is not finite, or they do not increase.
    """

    def __init__(self, size: int, positions: Sequence[float], distinguished: int = 8) -> None:
        require_whole("balise_reader", balise_capacity=size)
        places = _places(positions)
        if len(places) > size:
            raise ValueError(
                f"balise_reader: {len(places)} positions were given, but balise_capacity is {size}; raise it."
            )
        if any(not isfinite(place) for place in places):
            raise ValueError("balise_reader: a balise position is not a finite number.")
        wrong = [i for i, (earlier, later) in enumerate(pairwise(places), start=1) if later <= earlier]
        if wrong:
            i = wrong[0]
            raise ValueError(
                f"balise_reader: balises must be listed in increasing position, one at a place: number {i + 1} at "
                f"{places[i]:g} m follows number {i} at {places[i - 1]:g} m."
            )
        self.size, self.distinguished = size, distinguished
        start = (*places, *[UNUSED] * (size - len(places)))
        text = "Positions of the balises; 1e30 where an entry is not used"
        self.parameters: tuple[Signal, ...] = (parameter("positions", "m", start, text, size=size),)

    def count(self, before: Array, after: Array, direction: Array, p: Any) -> Array:
        """See `BaliseLayout`."""
        passed = 0.0 * before
        for i in range(self.size):
            place = direction * p.positions[i]
            passed = passed + np.where(place > direction * before, np.where(place <= direction * after, 1.0, 0.0), 0.0)
        distinct, at = 0.0 * before, before
        for _ in range(self.distinguished + 1):
            at = self.next(at, direction, p)
            distinct = distinct + np.where(direction * at <= direction * after, 1.0, 0.0)
        return np.where(distinct <= self.distinguished, distinct, passed)

    def next(self, position: Array, direction: Array, p: Any) -> Array:
        """See `BaliseLayout`."""
        nearest = UNUSED + 0.0 * position
        for i in range(self.size):
            place = direction * p.positions[i]
            nearest = np.where(place > direction * position, np.minimum(nearest, place), nearest)
        return direction * nearest


def _places(positions: object) -> tuple[float, ...]:
    try:
        return tuple(map(float, positions))  # type: ignore[call-overload] # what cannot be is refused
    except (TypeError, ValueError):
        raise ValueError(f"balise_reader: positions must be a list of numbers [m], got {positions!r}.") from None


def _place(k: Array, p: Any) -> Array:
    return p.first_balise + k * _spacing(p)


def _spacing(p: Any) -> Array:
    """A distance to divide by [m]: any where it is not positive, and no balise is laid."""
    return np.where(p.balise_spacing > 0.0, p.balise_spacing, 1.0)


def _total(p: Any) -> Array:
    return np.where(p.balise_spacing > 0.0, p.balise_total, 0.0)
