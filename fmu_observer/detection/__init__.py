"""Wheel slip: the two slip ratios of the literature, and the indicator of degraded adhesion."""

from fmu_observer.detection.slip_indicator import DEGRADED, NOMINAL, SlipIndicator, indicator_level, slip_filter_derivative
from fmu_observer.detection.slip_ratio import (
    odometer_slip,
    odometer_slip_from_speed_slip,
    speed_slip,
    speed_slip_from_odometer_slip,
)

SYSTEMS = (SlipIndicator,)

__all__ = [
    "DEGRADED",
    "NOMINAL",
    "SYSTEMS",
    "SlipIndicator",
    "indicator_level",
    "odometer_slip",
    "odometer_slip_from_speed_slip",
    "slip_filter_derivative",
    "speed_slip",
    "speed_slip_from_odometer_slip",
]
