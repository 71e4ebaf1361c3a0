"""Residuals of a train's sensors at a sample: pairs of speeds over a window, satellite position, ways between balises,
pressure. Pure functions that trace.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from plant_models.hybrid import Array

ABSENT = -1e9
"""Start value of the inputs of sensors that a train need not have: a sensor that reads this is not fitted."""
_BELOW = -1e8
HUGE = 1e9
ALIKE = 0.5  # errors of ways that differ by less than this factor have one cause


class Readings(NamedTuple):
    """What the sensors read, and which of them are fitted.

    Attributes:
        speeds: first odometer, second odometer, radar [m/s]; zero where absent. gps: position [m]. pressure: in the
            brake cylinder [Pa]. fitted: the three of `speeds`, 1 or 0. has_gps: 1 or 0. has_pressure: 1 or 0.
    """

    speeds: list[Array]
    gps: Array
    pressure: Array
    fitted: list[Array]
    has_gps: Array
    has_pressure: Array


def there(value: Array) -> Array:
    """1 where a sensor is fitted and reads, else 0.

    Args:
        value: its input.
    """
    return np.where(value > _BELOW, 1.0, 0.0)


def readings(u: Any) -> Readings:
    """What the sensors read."""
    fitted = [there(u.odometer_1), there(u.odometer_2), there(u.radar)]
    speeds = [np.where(f > 0.0, s, 0.0) for f, s in zip(fitted, (u.odometer_1, u.odometer_2, u.radar), strict=True)]
    has_gps, has_pressure = there(u.gps_position), there(u.cylinder_pressure)
    gps = np.where(has_gps > 0.0, u.gps_position, 0.0)
    return Readings(speeds, gps, np.where(has_pressure > 0.0, u.cylinder_pressure, 0.0), fitted, has_gps, has_pressure)


def tolerance(speed: Array, p: Any) -> Array:
    """Difference of two speeds that counts as one [m/s]: ``speed_floor + speed_share |v|``.

    Args:
        speed: of the train [m/s]. p: with `speed_floor` and `speed_share`.
    """
    return p.speed_floor + p.speed_share * np.abs(speed)


def voted_speed(read: Readings, raised: Array) -> Array:
    """Speed by a vote, two out of three: of the source that fewest alarms are about; of equals the radar, then the
    second odometer, then the first [m/s].

    Args:
        read: of the sensors. raised: alarms of the first six residuals of `MOTION`, shape (6,).
    """
    wheels, first, second, first_gps, second_gps, radar_gps = raised
    against = [wheels + first + first_gps, wheels + second + second_gps, first + second + radar_gps]
    speed, fewest = read.speeds[0], against[0]
    for source, ahead in ((1, 0.25), (2, 0.5)):
        fewer = np.where(against[source] - ahead < fewest, read.fitted[source], 0.0)
        speed = np.where(fewer > 0.0, read.speeds[source], speed)
        fewest = np.where(fewer > 0.0, against[source] - ahead, fewest)
    return speed
