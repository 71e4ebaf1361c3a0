"""The effort that the rail is believed to bear: cut to the estimated adhesion force in slip, probed upwards after it.

Pure functions of the memory of a sampled controller.
"""

from __future__ import annotations

import numpy as np

from plant_models.hybrid import Array
from plant_models.railway.control.logic import either, some


def next_available_effort(
    available: Array,
    adhesion_force: Array,
    sliding: Array,
    newly_degraded: Array,
    recovery: Array,
    *,
    margin: Array,
    floor: Array,
    limit: Array,
) -> Array:
    """Available effort [N] after one period.

    A wheel that slides turns with ``J dw = r (F - F_ad)``: only an effort below the adhesion force of this moment
    brings it back. So in slip the available effort falls to `margin` times that force at once. Where the adhesion has
    just been judged degraded, without slip beyond the limit, it falls to the force itself. Otherwise it rises by
    `recovery`.

    Args:
        available: before [N]. adhesion_force: estimate [N], any sign. sliding: 1 where the slip is beyond its limit.
        newly_degraded: 1 at the period in which the adhesion becomes degraded. recovery: rise in one period [N].
        margin: share of the adhesion force that is used in slip, < 1. floor: smallest available effort [N].
        limit: largest [N].
    """
    transmitted = np.abs(adhesion_force) * either(sliding, margin, 1.0)
    cut = np.minimum(available, np.maximum(transmitted, floor))
    return either(some(sliding, newly_degraded), cut, np.minimum(available + recovery, limit))
