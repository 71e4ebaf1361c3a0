"""The sum of the squares of a residual over a window, and the alarm that it raises. Pure functions that trace."""

from __future__ import annotations

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


def judge(before: Alarm, t: Array, exceeds: Array, raise_after: Array = 1.0, clear_after: Array = 1.0) -> Alarm:
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
