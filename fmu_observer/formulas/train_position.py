"""The confidence interval of a train's position and of its speed, as ETCS has them: SUBSET-026, 3.6.4.1; SUBSET-041.

Pure functions that trace. Amounts are what an odometer may have counted too much (over-reading) or too little
(under-reading) since the reference balise group.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from plant_models.hybrid import Array

_KMH = 1.0 / 3.6
SPEED_ERROR = 2.0 * _KMH
"""Of SUBSET-041 up to `SPEED_ERROR_UNTIL` [m/s]."""
SPEED_ERROR_UNTIL = 30.0 * _KMH
SPEED_ERROR_SLOPE = (12.0 - 2.0) / (500.0 - 30.0)
"""Of the allowed error above that speed: 12 km/h at 500 km/h [1]."""


class SafeFrontEnd(NamedTuple):
    """Args: low, high: min and max safe front end [m]."""

    low: Array
    high: Array


def reading_amount(fixed: Array, share: Array, travelled: Array, unread: Array) -> Array:
    """Over- or under-reading amount, ``fixed + share travelled + unread`` [m]: SUBSET-026, 3.6.4.1.1, with the
    amounts of SUBSET-041 at ``fixed = 5 m``, ``share = 0.05``.

    Args:
        fixed: at the group, error of its detection included [m]. share: of the distance travelled [1].
        travelled: since the group, either way [m]. unread: what the odometer cannot have counted [m].
    """
    return fixed + share * travelled + unread


def safe_front_end(estimated: Array, location_accuracy: Array, over: Array, under: Array) -> SafeFrontEnd:
    """Min and max safe front end, ``d_est - (Q + over)`` and ``d_est + (Q + under)`` [m]: SUBSET-026, 3.6.4.1.5.

    Args:
        estimated: front end by the odometer [m]. location_accuracy: Q_LOCACC of the reference group [m].
        over, under: amounts [m].
    """
    return SafeFrontEnd(estimated - (location_accuracy + over), estimated + (location_accuracy + under))


def allowed_speed_error(speed: Array) -> Array:
    """By how much a speed may be shown wrong [m/s]: SUBSET-041, 2 km/h up to 30 km/h, rising to 12 km/h at 500 km/h.

    Args:
        speed: either way [m/s].
    """
    return SPEED_ERROR + SPEED_ERROR_SLOPE * np.maximum(np.abs(speed) - SPEED_ERROR_UNTIL, 0.0)
