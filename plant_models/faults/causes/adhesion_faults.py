"""Faults caused by the adhesion that the train has: too much brake locks the wheel, too much traction spins it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from plant_models.faults.fault_cause import (
    ADHESION_LIMIT,
    BRAKE_RELEASED,
    EFFORT,
    RELEASE_TIME,
    Fault,
    FaultCause,
    one_where,
)
from plant_models.hybrid import Array
from plant_models.hybrid.signal import parameter, state

ROLLING = 1e-12
"""A wheel that slides less than this share of a full lock or skid rolls; below it nothing flows."""


class AdhesionFaults(FaultCause):
    """The wheel goes to lock, linearly in `lock_time`, where the brake demanded is above the adhesion limit; to a skid
    of `spin_depth` where traction is; and back to rolling, from full in `release_time`, where the demand is below
    `sliding_share` of the limit.

    Between the two limits a wheel that is more than half-way goes on, one that is less goes back: the hysteresis.
    """

    name = "adhesion"
    description = "Jams and skids of a wheel that is asked for more than its adhesion"
    ranges = (("lock_time", 0.05, 0.5), ("spin_depth", 0.1, 0.5), ("sliding_share", 0.5, 1.0))
    inputs = (EFFORT, ADHESION_LIMIT, BRAKE_RELEASED)
    parameters = (
        RELEASE_TIME,
        parameter("lock_time", "s", 0.1, "From rolling to a full lock or skid", min=1e-4),
        parameter("spin_depth", "1", 0.3, "Depth of a full skid", min=1e-3, max=1.0),
        parameter(
            "sliding_share", "1", 0.8, "Sliding adhesion over adhesion limit: below it a wheel rolls again", min=0.0
        ),
    )
    states = (
        state("lock", "1", 0.0, "Share of a full lock at start, 0 to 1"),
        state("spin", "1", 0.0, "Share of a full skid at start, 0 to 1"),
    )
    switchings = ("locking", "half_locked", "locked", "spinning", "half_spun", "spun")

    def fault(self, t: Array, x: Any, u: Any, p: Any, passed: Array, values: Sequence[Array]) -> Fault:
        lock, spin = (np.where(share > 2.0 * ROLLING, np.minimum(share, 1.0), 0.0) for share in (x.lock, x.spin))
        return Fault(p.spin_depth * spin - lock)

    def rates(self, t: Array, x: Any, u: Any, p: Any, passed: Array) -> dict[str, Array]:
        brake = np.maximum(-u.effort, 0.0) * (1.0 - one_where(u.brake_released > 0.5))
        traction = np.maximum(u.effort, 0.0)
        return {"lock": _rate(brake, passed[:3], u, p), "spin": _rate(traction, passed[3:], u, p)}

    def switching(self, t: Array, x: Any, u: Any, p: Any) -> Sequence[Array]:
        return [share - bound for share in (x.lock, x.spin) for bound in (ROLLING, 0.5, 1.0)]

    def requirements(self, p: Any) -> dict[str, Array]:
        """Sliding adhesion is not above the limit."""
        return {"sliding_share must be at most 1": one_where(p.sliding_share <= 1.0)}


def _rate(demand: Array, passed: Array, u: Any, p: Any) -> Array:
    """Rate of a lock or a skid [1/s]; `passed`: above rolling, above half, above full."""
    lets_go, half_way, full = passed[0], passed[1], passed[2]
    beyond = one_where(demand > u.adhesion_limit)
    held = half_way * one_where(demand > p.sliding_share * u.adhesion_limit)
    grows = np.maximum(beyond, held)
    return grows * (1.0 - full) / p.lock_time - (1.0 - grows) * lets_go / p.release_time
