"""Coupler protection: how far the effort may move when the coupler behind the locomotive is loaded. Pure functions."""

from __future__ import annotations

import numpy as np

from plant_models.hybrid import Array


def coupler_headroom(load: Array, soft_limit: Array, limit: Array) -> Array:
    """Share of the effort's rate that may load the coupler further [1]: 1 up to the soft limit, 0 at the limit, then
    negative.

    Beyond the limit the sign is that of a forced step back, -1 at and beyond ``2 limit - soft_limit``.

    Args:
        load: tension, or compression, positive [N]. soft_limit, limit: [N], soft_limit < limit.
    """
    return np.clip((limit - load) / np.maximum(limit - soft_limit, 1.0), -1.0, 1.0)


def effort_steps(
    effort: Array, coupler_force: Array, largest_step: Array, soft_limit: Array, limit: Array
) -> tuple[Array, Array]:
    """Largest steps down and up of the effort in one period [N]; a negative one is a step the other way that must be
    made.

    More traction (or less brake) pulls at the coupler, less traction (or more brake) pushes into it. Traction and brake
    may always go back to zero at the full rate: else a pressed coupler would keep the traction on under a brake. And
    what must be made goes to zero at most: a tension that others cause is no reason to brake the locomotive.

    Args:
        effort: until now [N]. coupler_force: force in the first coupler, tension > 0 [N].
        largest_step: rate limit times period [N]. soft_limit, limit: as in `coupler_headroom` [N].
    """
    down = largest_step * coupler_headroom(-coupler_force, soft_limit, limit)
    up = largest_step * coupler_headroom(coupler_force, soft_limit, limit)
    return np.maximum(down, np.minimum(effort, largest_step)), np.maximum(up, np.minimum(-effort, largest_step))
