"""The printed formulas of the branches point by point, Omar 2012, section 2.5. Pure functions that trace; uses the
recursion of the tips, which says where a curve has gone round.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fmu_observer.observers.signature.tip_recursion import Tips, next_tips
from plant_models.hybrid import Signal, memory
from plant_models.hybrid.system import Array

TOLERANCE = 0.01
"""Of the ordinate, as printed."""
FLAT = -1e9  # below every second difference

PRINTED_MEMORY: tuple[Signal, ...] = (
    memory("ordinate_before", "1", 0.0, "Ordinate of the long signature one sample ago"),
    memory("tip_ordinate", "1", 0.0, "Ordinate of the last tip, y*"),
    memory("near", "1", 0.0, "Smallest abscissa at that ordinate since the last tip"),
    memory("near_before", "1", 0.0, "Smallest abscissa at the tip's ordinate between the last two tips"),
    memory("short_abscissa", "1", 0.0, "Abscissa of the short signature one sample ago"),
    memory("short_ordinate", "1", 0.0, "Ordinate of the short signature one sample ago"),
    memory("short_earlier", "1", 0.0, "Ordinate of the short signature two samples ago"),
    memory("bend", "1", FLAT, "Largest second difference of the short ordinates since the last tip"),
    memory("bend_at", "1", 0.0, "Abscissa there"),
    memory("bend_before", "1", FLAT, "Largest second difference between the last two tips"),
    memory("bend_at_before", "1", 0.0, "Abscissa there"),
)


class Printed(NamedTuple):
    """Values of `PRINTED_MEMORY`, in their order."""

    ordinate: Array
    tip_ordinate: Array
    near: Array
    near_before: Array
    short_abscissa: Array
    short_ordinate: Array
    short_earlier: Array
    bend: Array
    bend_at: Array
    bend_before: Array
    bend_at_before: Array


def next_printed(
    m: Tips, q: Printed, long_point: tuple[Array, Array], short_point: tuple[Array, Array], patience: Array
) -> tuple[Tips, Printed]:
    """Memory after a sample, with the properties by the printed formulas.

    ``|S_y - y*| < 0.01`` asks for the ordinate of a tip that is still to come; here it is that of the last one.

    Args:
        m: tips before. q: the rest before. long_point: abscissa and ordinate of the new point of S1. short_point: of
            S2. patience: samples without a tip after which the count begins anew.
    """
    tips = next_tips(m, long_point[0], short_point[0], patience)
    tip = tips.since_tip < 0.5
    near = np.where(np.abs(long_point[1] - q.tip_ordinate) < TOLERANCE, np.minimum(q.near, long_point[0]), q.near)
    bend = short_point[1] - 2.0 * q.short_ordinate + q.short_earlier
    sharper = bend > q.bend
    best, best_at = np.where(sharper, bend, q.bend), np.where(sharper, q.short_abscissa, q.bend_at)
    rest = Printed(
        long_point[1],
        np.where(tip, q.ordinate, q.tip_ordinate),
        np.where(tip, m.before, near),
        np.where(tip, near, q.near_before),
        short_point[0],
        short_point[1],
        q.short_ordinate,
        np.where(tip, FLAT, best),
        np.where(tip, q.short_abscissa, best_at),
        np.where(tip, best, q.bend_before),
        np.where(tip, best_at, q.bend_at_before),
    )
    top = np.maximum(m.before, m.last_tip)
    nearest = np.minimum(near, q.near_before)
    low = np.minimum(m.lowest, m.lowest_before)
    at_bend = np.where(best > q.bend_before, best_at, q.bend_at_before)
    return tips._replace(
        length=np.where(tip, 0.5 * (top + nearest) - low, m.length),
        short_tip=np.where(tip, at_bend, m.short_tip),
        gap=np.where(tip, top - nearest, m.gap),
    ), rest
