"""Intervals, and the accelerations that a train can have within stated limits. Pure functions that trace.

Müller's theorem: where the true speed lies between v_low and v_high and each end moves with the least or greatest
acceleration that is possible at it, it goes on lying there (M. Müller, Math. Z. 26, 1927).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from plant_models.hybrid import Array

GRAVITY = 9.81  # [m/s2]
_FAR = 1e9
"""In place of infinity, of which no difference can be formed."""


class Interval(NamedTuple):
    """Args: low, high: its ends."""

    low: Array
    high: Array


def meet(a: Interval, b: Interval) -> Array:
    """1 where two intervals have a common point, else 0.

    Args:
        a, b: the two.
    """
    return np.where(np.maximum(a.low, b.low) <= np.minimum(a.high, b.high), 1.0, 0.0)


def intersection_or_hull(a: Interval, b: Interval) -> Interval:
    """What is common to two intervals; where nothing is, all that lies in or between them: one of them is wrong, and it
    is not known which.

    Args:
        a, b: the two.
    """
    common = meet(a, b) > 0.0
    return Interval(
        np.where(common, np.maximum(a.low, b.low), np.minimum(a.low, b.low)),
        np.where(common, np.minimum(a.high, b.high), np.maximum(a.high, b.high)),
    )


def relaxed_intersection(members: Interval, counts: Array, outliers: int) -> Interval:
    """What at least all but `outliers` of some intervals have in common, if no more of them are wrong: the q-relaxed
    intersection (Jaulin 2009), of which this is the part between the ends that are left when the `outliers` highest of
    the lower ends and the `outliers` lowest of the upper ends are left out. Where it is empty more of them are wrong.

    Args:
        members: their ends, each of shape (n,). counts: 1 for those that count, shape (n,); of too few nothing follows.
        outliers: how many may be wrong.
    """
    low = _later_largest(np.where(counts > 0.0, members.low, -_FAR), outliers)
    high = -_later_largest(np.where(counts > 0.0, -members.high, -_FAR), outliers)
    return Interval(low, high)


def _later_largest(values: Array, place: int) -> Array:
    """The largest value but so many."""
    best = [values[0], *([-_FAR] * place)]
    for value in values[1:]:
        left = value
        for k, kept in enumerate(best):
            best[k], left = np.maximum(kept, left), np.minimum(kept, left)
    return best[-1]


def chosen(choice: Array, a: Interval, b: Interval) -> Interval:
    """The first where a choice is above zero, else the second.

    Args:
        choice: 1 or 0. a: the first. b: the second.
    """
    return Interval(np.where(choice > 0.0, a.low, b.low), np.where(choice > 0.0, a.high, b.high))


def true_speeds(reading: Array, effort: Interval, p: Any) -> Interval:
    """Speeds at which an odometer that rolls can read so [m/s].

    Its wheel is larger or smaller by `wheel_error`; it creeps by at most `creep`, faster than the train where it pulls
    and slower where it brakes; and it is quantised and noisy within `odometer_error`.

    Args:
        reading: [m/s]. effort: that may act at the wheel rim [N]. p: named tuple with these.
    """
    low, high = reading - p.odometer_error, reading + p.odometer_error
    fast = (1.0 + p.wheel_error) * (1.0 + np.where(effort.high > 0.0, p.creep, 0.0))
    slow = (1.0 - p.wheel_error) * (1.0 - np.where(effort.low < 0.0, p.creep, 0.0))
    return Interval(np.where(low > 0.0, low / fast, low / slow), np.where(high > 0.0, high / slow, high / fast))


def transmitted_effort(effort: Array, p: Any) -> Interval:
    """Forces that an effort may cause on the rail [N]: nothing where the wheels slip, all of it where they do not.

    Args:
        effort: traction positive, brake negative [N]. p: named tuple with `effort_error` [1].
    """
    most = (1.0 + p.effort_error) * effort
    return Interval(np.minimum(most, 0.0), np.maximum(most, 0.0))


def possible_accelerations(low_at: Array, high_at: Array, force: Interval, p: Any) -> Interval:
    """Least acceleration of a train at one speed and greatest at another one [m/s2].

    Mass, running resistance and gradient lie within their errors. Brake and resistance act against the motion: they
    stop the train, and never push it back.

    Args:
        low_at: speed of the least one [m/s]. high_at: of the greatest one [m/s]. force: on the rail [N].
        p: named tuple with `mass`, `davis_a`, `davis_b`, `davis_c` and the errors.
    """
    slope = GRAVITY * p.gradient_max
    braked = force.low - _resistance(low_at, p) * (1.0 + p.resistance_error)
    rolled_back = _over_mass(_resistance(low_at, p) * (1.0 - p.resistance_error), p).low - slope
    least = np.where(low_at > 0.0, _over_mass(braked, p).low - slope, np.minimum(rolled_back, 0.0))
    driven = force.high - _resistance(high_at, p) * (1.0 - p.resistance_error)
    pushed = _over_mass(force.high + _resistance(high_at, p) * (1.0 + p.resistance_error), p).high + slope
    greatest = _over_mass(driven, p).high + slope
    return Interval(
        least, np.where(high_at > 0.0, greatest, np.where(high_at < 0.0, pushed, np.maximum(greatest, 0.0)))
    )


def _over_mass(force: Array, p: Any) -> Interval:
    """Accelerations by a force, of the lightest and the heaviest train [m/s2]."""
    light, heavy = force / (p.mass * (1.0 - p.mass_error)), force / (p.mass * (1.0 + p.mass_error))
    return Interval(np.minimum(light, heavy), np.maximum(light, heavy))


def _resistance(speed: Array, p: Any) -> Array:
    """Davis resistance by its size [N]."""
    size = np.abs(speed)
    return p.davis_a + p.davis_b * size + p.davis_c * size * size
