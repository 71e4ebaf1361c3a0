"""The printed formulas of the branches point by point, Omar 2012, section 2.5. Pure functions that trace; uses the
recursion of the tips, which says where a curve has gone round.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.formulas.signatures.tip_recursion import next_tips
from plant_models.hybrid import Array, Signal, memory

_TOLERANCE = 0.01
"""Of the ordinate, as printed."""
_FLAT = -1e9  # below every second difference

PRINTED_MEMORY: tuple[Signal, ...] = (
    memory("ordinate_before", "1", 0.0, "Ordinate of the long signature one sample ago"),
    memory("tip_ordinate", "1", 0.0, "Ordinate of the last tip, y*"),
    memory("near", "1", 0.0, "Smallest abscissa at that ordinate since the last tip"),
    memory("near_before", "1", 0.0, "Smallest abscissa at the tip's ordinate between the last two tips"),
    memory("short_abscissa", "1", 0.0, "Abscissa of the short signature one sample ago"),
    memory("short_ordinate", "1", 0.0, "Ordinate of the short signature one sample ago"),
    memory("short_earlier", "1", 0.0, "Ordinate of the short signature two samples ago"),
    memory("bend", "1", _FLAT, "Largest second difference of the short ordinates since the last tip"),
    memory("bend_at", "1", 0.0, "Abscissa there"),
    memory("bend_before", "1", _FLAT, "Largest second difference between the last two tips"),
    memory("bend_at_before", "1", 0.0, "Abscissa there"),
)


def next_printed(
    x: Any, long_point: tuple[Array, Array], short_point: tuple[Array, Array], patience: Array
) -> dict[str, Array]:
    """Memory after a sample, with the properties by the printed formulas.

    ``|S_y - y*| < 0.01`` asks for the ordinate of a tip that is still to come; here it is that of the last one.

    Args:
        x: before, by name. long_point: abscissa and ordinate of the new point of S1. short_point: of
            S2. patience: samples without a tip after which the count begins anew.
    """
    tips = next_tips(x, long_point[0], short_point[0], patience)
    tip = tips["since_tip"] < 0.5
    near = np.where(np.abs(long_point[1] - x.tip_ordinate) < _TOLERANCE, np.minimum(x.near, long_point[0]), x.near)
    bend = short_point[1] - 2.0 * x.short_ordinate + x.short_earlier
    sharper = bend > x.bend
    best, best_at = np.where(sharper, bend, x.bend), np.where(sharper, x.short_abscissa, x.bend_at)
    at_bend = np.where(best > x.bend_before, best_at, x.bend_at_before)
    return tips | {
        "ordinate_before": long_point[1],
        "tip_ordinate": np.where(tip, x.ordinate_before, x.tip_ordinate),
        "near": np.where(tip, x.abscissa_before, near),
        "near_before": np.where(tip, near, x.near_before),
        "short_abscissa": short_point[0],
        "short_ordinate": short_point[1],
        "short_earlier": x.short_ordinate,
        "bend": np.where(tip, _FLAT, best),
        "bend_at": np.where(tip, x.short_abscissa, best_at),
        "bend_before": np.where(tip, best, x.bend_before),
        "bend_at_before": np.where(tip, best_at, x.bend_at_before),
        **_properties(x, tip, near, at_bend),
    }


def _properties(x: Any, tip: Array, near: Array, at_bend: Array) -> dict[str, Array]:
    """Properties, new at a tip, by the smallest abscissa at its ordinate and the abscissa of the sharpest bend."""
    top = np.maximum(x.abscissa_before, x.last_tip)
    nearest = np.minimum(near, x.near_before)
    low = np.minimum(x.lowest, x.lowest_before)
    return {
        "held_length": np.where(tip, 0.5 * (top + nearest) - low, x.held_length),
        "held_short_tip": np.where(tip, at_bend, x.held_short_tip),
        "held_gap": np.where(tip, top - nearest, x.held_gap),
    }
