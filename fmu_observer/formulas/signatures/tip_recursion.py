"""Branch tips of a signature point by point: what `properties.branch_tips` finds in a stored curve, found with a few
numbers of memory. Pure functions that trace.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import Array, Signal, memory

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


def next_tips(x: Any, long_abscissa: Array, short_abscissa: Array, patience: Array) -> dict[str, Array]:
    """Memory after a sample.

    A tip is a local maximum of the long signature's abscissa in the upper half of its extent. Extremes are those of
    the last two ways between tips, so that both branches count.

    Args:
        x: before, by name. long_abscissa: of the new point of S1. short_abscissa: of that of S2. patience: samples
            without a tip after which the count begins anew.
    """
    before = x.abscissa_before
    lowest = np.minimum(x.lowest, x.lowest_before)
    middle = 0.5 * (lowest + np.maximum(x.highest, x.highest_before))
    tip = (before > x.abscissa_earlier) * (before >= long_abscissa) * (before > middle)
    length = 0.5 * (before + x.last_tip) - lowest
    lost = x.since_tip >= patience
    kept = np.where(lost, 0.0, x.tips)
    return {
        "abscissa_before": long_abscissa,
        "abscissa_earlier": before,
        "last_tip": np.where(tip, before, x.last_tip),
        "lowest": np.where(tip, long_abscissa, np.minimum(x.lowest, long_abscissa)),
        "lowest_before": np.where(tip, x.lowest, x.lowest_before),
        "highest": np.where(tip, long_abscissa, np.maximum(x.highest, long_abscissa)),
        "highest_before": np.where(tip, x.highest, x.highest_before),
        "short_highest": np.where(tip, short_abscissa, np.maximum(x.short_highest, short_abscissa)),
        "short_before": np.where(tip, x.short_highest, x.short_before),
        "tips": np.where(tip, kept + 1.0, kept),
        "since_tip": np.where(tip, 0.0, np.where(lost, 0.0, x.since_tip + 1.0)),
        "held_length": np.where(tip, length, x.held_length),
        "held_short_tip": np.where(tip, np.maximum(x.short_highest, x.short_before), x.held_short_tip),
        "held_gap": np.where(tip, np.abs(before - x.last_tip), x.held_gap),
    }
