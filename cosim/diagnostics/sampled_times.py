"""Sampled times: what a call takes as a rule, from a few that were timed. Standard library only.

One in many calls is timed, and what it took stands for all of them: a call during which the operating system did
something else, for milliseconds, must not. So times are sorted into bins that double in width, which takes no memory to
speak of, and those far above the median do not count.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate

BINS = 40
"""The last one holds calls of nine minutes; as in the C stepper."""
_ABOVE_MEDIAN = 3
"""Bins above the one of the median that still count: calls up to 8 to 16 times as long."""


def bin_of(seconds: float) -> int:
    """The bin of a time: 0 up to 2 ns, 1 up to 4 ns, and so on.

    Args:
        seconds: the time [s].
    """
    return min(max(int(seconds * 1e9) | 1, 1).bit_length() - 1, BINS - 1)


def typical_seconds(calls: Sequence[int], seconds: Sequence[float]) -> float:
    """Mean time of a call, without those that something else interrupted.

    Args:
        calls: how many calls fell into each bin, shape (BINS,). seconds: what these took in all [s], shape (BINS,).

    Returns:
        The mean time [s]; 0 where no call was timed.
    """
    total = sum(calls)
    if not total:
        return 0.0
    median = next(number for number, below in enumerate(accumulate(calls)) if 2 * below >= total)
    last = median + _ABOVE_MEDIAN + 1
    return sum(seconds[:last]) / sum(calls[:last])
