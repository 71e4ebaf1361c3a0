"""Residuals of a train's sensors at a sample: pairs of speeds over a window, satellite position, ways between balises,
pressure. Pure functions that trace.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from fmu_observer.formulas.diagnosis.isolation_table import largest
from fmu_observer.formulas.diagnosis.window_inversion import windowed_square
from plant_models.hybrid import Array, vector

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


def speed_ratios(x: Any, read: Readings, speed: Array, p: Any) -> tuple[list[Array], dict[str, Array]]:
    """Residuals of the six pairs of sources of speed over their thresholds.

    The three pairs without the satellites are root mean squares over N samples, those with them the mean over L: the
    lead of the position over the way may not change.

    Args:
        read: of the sensors. speed: of the train [m/s].

    Returns:
        Ratios in the order of the first six residuals of `MOTION`, and new values of states by name.
    """
    allowed = tolerance(speed, p)
    ratios: list[Array] = []
    after: dict[str, Array] = {}
    for name, i, j, threshold in (
        ("squares_odometers", 0, 1, p.threshold_wheels),
        ("squares_first_radar", 0, 2, p.threshold_radar),
        ("squares_second_radar", 1, 2, p.threshold_radar),
    ):
        both, before = read.fitted[i] * read.fitted[j], getattr(x, name)
        windowed = windowed_square(before, both * (read.speeds[i] - read.speeds[j]) / allowed)
        ratios.append(np.sqrt(windowed.value / (before.shape[0] + 1.0)) / threshold)
        after[name] = windowed.memory
    for name, way, fitted in zip(("lead_first", "lead_second", "lead_radar"), x.way, read.fitted, strict=True):
        now, lead = read.has_gps * (read.gps - way), getattr(x, name)
        window = lead.shape[0] * p.sample_period
        ratios.append(fitted * np.abs(now - lead[0]) / (window * allowed * p.threshold_gps))
        after[name] = vector(*lead[1:], now)
    return ratios, after


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


def way_ratios(errors: list[Array], fitted: list[Array], limit: Array) -> tuple[list[Array], Array]:
    """Residuals of the ways from the last balise to this one over their thresholds.

    Where the ways of all sources are off by much the same, the balise is; else the sources that are off.

    Args:
        errors: distance of the balises less the way of each source [m]. fitted: 1 for those that are there and have
            shown no fault on the way. limit: of an error [m].

    Returns:
        Ratios of the ways, and that of the balise.
    """
    ratios = [f * np.abs(error) / limit for error, f in zip(errors, fitted, strict=True)]
    most = largest(ratios)
    least: Array = HUGE
    for ratio, there_is in zip(ratios, fitted, strict=True):
        least = np.minimum(least, np.where(there_is > 0.0, ratio, HUGE))
    alike = np.where(least < HUGE, np.where(least > ALIKE * most, 1.0, 0.0), 0.0)
    return [(1.0 - alike) * ratio for ratio in ratios], alike * most
