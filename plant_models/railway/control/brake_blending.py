"""Blending: how a wanted force is shared between the locomotive's drive and the air brake of the train. Pure
functions.
"""

from __future__ import annotations

import numpy as np

from plant_models.hybrid import Array


def air_brake_demand(force: Array, capacity: Array, full_brake_force: Array) -> Array:
    """Demand to the air brake, 0..1, for a wanted force [N] (brake < 0); 0 where the train has no air brake.

    Args:
        force: wanted force [N]. capacity: brake force over which it is shared in proportion [N]: `full_brake_force`
            where air brakes alone, more where the electric brake takes its part.
        full_brake_force: force of the whole train's air brake at demand 1 [N], 0 for none.
    """
    demand = np.clip(-force / np.maximum(capacity, 1.0), 0.0, 1.0)
    return np.where(full_brake_force > 0.0, demand, 0.0)


def electric_part(force: Array, built_up: Array, brake_limit: Array) -> Array:
    """Electric brake effort [N] (<= 0): what the air brake has not built up yet, within the electric limit.

    So the electric brake bridges the seconds that air needs, and gives way to it.

    Args:
        force: wanted brake force [N], < 0. built_up: force of the air brake by now [N], >= 0. brake_limit: [N], >= 0.
    """
    return np.maximum(np.minimum(force + built_up, 0.0), -brake_limit)
