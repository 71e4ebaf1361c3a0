"""Branch tips of a signature point by point: what `properties.branch_tips` finds in a stored curve, found with a few
numbers of memory. Pure functions that trace.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from plant_models.hybrid import Signal, memory
from plant_models.hybrid.system import Array

CYCLES = 4.0
"""Tips before the properties count: the first two may be those of a transient."""

TIP_MEMORY: tuple[Signal, ...] = (
    memory("abscissa_before", "1", 0.0, "Abscissa of the long signature one sample ago"),
    memory("abscissa_earlier", "1", 0.0, "Abscissa of the long signature two samples ago"),
    memory("last_tip", "1", 0.0, "Abscissa of the last tip"),
    memory("lowest", "1", 0.0, "Smallest abscissa of the long signature since the last tip"),
    memory("lowest_before", "1", 0.0, "Smallest abscissa between the last two tips"),
    memory("highest", "1", 0.0, "Largest abscissa of the long signature since the last tip"),
    memory("highest_before", "1", 0.0, "Largest abscissa between the last two tips"),
    memory("short_highest", "1", 0.0, "Largest abscissa of the short signature since the last tip"),
    memory("short_before", "1", 0.0, "Largest abscissa of the short signature between the last two tips"),
    memory("tips", "1", 0.0, "Tips found since the start, or since the signal last stopped to oscillate"),
    memory("since_tip", "1", 0.0, "Samples since the last tip"),
    memory("held_length", "1", 0.0, "Property r1 at the last tip"),
    memory("held_short_tip", "1", 0.0, "Property r2 at the last tip"),
    memory("held_gap", "1", 0.0, "Property r3 at the last tip"),
)


class Tips(NamedTuple):
    """Values of `TIP_MEMORY`, in their order."""

    before: Array
    earlier: Array
    last_tip: Array
    lowest: Array
    lowest_before: Array
    highest: Array
    highest_before: Array
    short_highest: Array
    short_before: Array
    tips: Array
    since_tip: Array
    length: Array
    short_tip: Array
    gap: Array


def next_tips(m: Tips, long_abscissa: Array, short_abscissa: Array, patience: Array) -> Tips:
    """Memory after a sample.

    A tip is a local maximum of the long signature's abscissa in the upper half of its extent. Extremes are those of
    the last two ways between tips, so that both branches count.

    Args:
        m: before. long_abscissa: of the new point of S1. short_abscissa: of that of S2. patience: samples without a tip
            after which the count begins anew.
    """
    middle = 0.5 * (np.minimum(m.lowest, m.lowest_before) + np.maximum(m.highest, m.highest_before))
    tip = (m.before > m.earlier) * (m.before >= long_abscissa) * (m.before > middle)
    lowest = np.minimum(m.lowest, m.lowest_before)
    length = 0.5 * (m.before + m.last_tip) - lowest
    lost = m.since_tip >= patience
    kept = np.where(lost, 0.0, m.tips)
    return Tips(
        long_abscissa,
        m.before,
        np.where(tip, m.before, m.last_tip),
        np.where(tip, long_abscissa, np.minimum(m.lowest, long_abscissa)),
        np.where(tip, m.lowest, m.lowest_before),
        np.where(tip, long_abscissa, np.maximum(m.highest, long_abscissa)),
        np.where(tip, m.highest, m.highest_before),
        np.where(tip, short_abscissa, np.maximum(m.short_highest, short_abscissa)),
        np.where(tip, m.short_highest, m.short_before),
        np.where(tip, kept + 1.0, kept),
        np.where(tip, 0.0, np.where(lost, 0.0, m.since_tip + 1.0)),
        np.where(tip, length, m.length),
        np.where(tip, np.maximum(m.short_highest, m.short_before), m.short_tip),
        np.where(tip, np.abs(m.before - m.last_tip), m.gap),
    )
