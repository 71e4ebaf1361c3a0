"""What a window of past samples shows: the mean square of a residual, and one parameter, by simulation for a grid of
values. Pure functions that trace; the simulation is the caller's.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from plant_models.hybrid import Array, vector


class _Windowed(NamedTuple):
    """A residual over its window.

    Attributes:
        value: the sum. memory: what is carried to the next sample.
    """

    value: Array
    memory: Array


class Alarm(NamedTuple):
    """An alarm with its persistence: what is carried from sample to sample.

    Attributes:
        raised: 1 while it is raised, else 0 [1]. contrary: samples in a row that spoke against that [1].
        since: instant of its last change [s].
    """

    raised: Array
    contrary: Array
    since: Array


class Inverted(NamedTuple):
    """The value at which simulation and measurement agree.

    Attributes:
        value: of the parameter. crossings: intervals of the grid that bracket it [1]: 1 as it should be; 0 where the
            grid does not bracket, and the value is the end of the grid nearer to the measurement; 2 or more where the
            measurement has several explanations, of which the one nearest to the value before is taken.
    """

    value: Array
    crossings: Array


def grid_around(
    previous: Array, count: int, lowest: Array = 0.7, highest: Array = 1.7, least: Array = 0.0, most: Array = np.inf
) -> list[Array]:
    """Values ``[0.7 p .. 1.7 p]`` in equal steps around the last estimate: Omar 2012, 7.7.7.

    Args:
        previous: last estimate p, positive. count: of values, at least 2. lowest: factor of the first value [1].
        highest: factor of the last value [1]. least: smallest value allowed. most: largest value allowed; both move the
            ends of the grid, so that its values stay apart.

    Raises:
        ValueError: fewer than two values cannot bracket.
    """
    if count < 2:
        raise ValueError(f"A grid of {count} values brackets nothing; expected at least 2.")
    low = np.minimum(np.maximum(lowest * previous, least), most)
    high = np.minimum(np.maximum(highest * previous, least), most)
    return [low + (high - low) * (i / (count - 1)) for i in range(count)]


def invert(grid: Sequence[Array], differences: Sequence[Array], previous: Array) -> Inverted:
    """The value of the parameter at which the difference is zero, linear between two values of the grid.

    The print takes the two values with the smallest differences (7.7.8), which may lie on one side: then it
    extrapolates. Here a change of sign decides, and a grid without one is reported.

    Args:
        grid: values, rising. differences: at each value what was simulated at the end of the window minus what was
            measured there. previous: last estimate.

    Returns:
        The value, and by how many intervals it was bracketed.

    Raises:
        ValueError: grid and differences are not equally many, or fewer than two.

    Source:
        Omar 2012, (7.7.8) repaired.
    """
    if len(grid) != len(differences) or len(grid) < 2:
        raise ValueError(f"{len(grid)} values and {len(differences)} differences; expected equally many, at least 2.")
    ends: Array = np.where(np.abs(differences[0]) <= np.abs(differences[-1]), grid[0], grid[-1])
    value: Array = ends
    distance, crossings = 0.0 * ends + np.inf, 0.0 * ends
    for i in range(len(grid) - 1):
        d0, d1 = differences[i], differences[i + 1]
        inside = _crosses(d0, d1, first=i == 0)
        apart = np.where(inside > 0.0, d1 - d0, 1.0)
        here = grid[i] - np.where(inside > 0.0, d0 * (grid[i + 1] - grid[i]) / np.where(apart == 0.0, 1.0, apart), 0.0)
        gap = np.abs(here - previous)
        nearer = np.where(gap < distance, inside, 0.0)
        value = np.where(nearer > 0.0, here, value)
        distance = np.where(nearer > 0.0, gap, distance)
        crossings = crossings + inside
    return Inverted(value, crossings)


def _crosses(before: Array, after: Array, *, first: bool) -> Array:
    """1 where an interval holds a zero: one at its end belongs to the interval on its left, at the very first value to
    the first.
    """
    left = np.where(before * after < 0.0, 1.0, np.where(after == 0.0, np.where(before == 0.0, 0.0, 1.0), 0.0))
    return np.maximum(left, np.where(before == 0.0, 1.0, 0.0)) if first else left


def smoothed(previous: Array, raw: Array, gamma: Array = 0.2) -> Array:
    """``gamma p + (1 - gamma) raw``: Omar 2012, (7.7.8).

    Args:
        previous: last estimate p. raw: value found now. gamma: weight of the last estimate [1], from 0 to 1.
    """
    return gamma * previous + (1.0 - gamma) * raw


def windowed_square(memory: Array, residual: Array) -> _Windowed:
    """``r(k) = sum of x(i)^2, i = k - N + 1 .. k``: Omar 2012, (7.6.10), (7.7.6).

    Args:
        memory: squares of the N - 1 samples before, oldest first, shape (N - 1,). residual: x(k).

    Returns:
        The sum, and the memory for the next sample. The sum is made anew at each sample: nothing accumulates.
    """
    square = residual * residual
    kept = [memory[i] for i in range(memory.shape[0])]
    value = square
    for earlier in kept:
        value = value + earlier
    return _Windowed(value, vector(*kept[1:], square) if kept else memory)


def evaluate(before: Alarm, t: Array, exceeds: Array, raise_after: Array = 1.0, clear_after: Array = 1.0) -> Alarm:
    """One sample of an alarm: raised after so many samples in a row above the threshold, cleared after so many below.

    Args:
        before: what the last sample left. exceeds: 1 where the residual is above its threshold, else 0.
        raise_after: samples in a row until it is raised, at least 1 [1].
        clear_after: samples in a row until it is cleared, at least 1 [1].

    Returns:
        What the alarm is after the sample.

    Source:
        Omar 2012, 7.5.1 (iii) asks for a persistence and prints none.
    """
    speaks_against: Array = np.where(exceeds > 0.0, 1.0 - before.raised, before.raised)
    contrary = speaks_against * (before.contrary + 1.0)
    needed: Array = np.where(before.raised > 0.0, clear_after, raise_after)
    changes: Array = np.where(contrary >= needed - 0.5, speaks_against, 0.0)
    raised: Array = np.where(changes > 0.0, 1.0 - before.raised, before.raised)
    return Alarm(raised, (1.0 - changes) * contrary, np.where(changes > 0.0, t, before.since))
