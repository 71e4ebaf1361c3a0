"""Detection: the two slip ratios, slip indicators, the adhesion condition, and the risk of a coupler to break."""

from fmu_observer.detection.adhesion_detector import AdhesionDetector, condition_of
from fmu_observer.detection.adhesion_map import AdhesionMap, adhesion_map, degraded_map, nominal_map, published_map
from fmu_observer.detection.coupler_risk import CouplerRisk
from fmu_observer.detection.excessive_slip import ExcessiveSlip
from fmu_observer.detection.slip_indicator import (
    DEGRADED,
    NOMINAL,
    SlipIndicator,
    indicator_level,
    slip_filter_derivative,
)
from fmu_observer.detection.slip_ratio import (
    odometer_slip,
    odometer_slip_from_speed_slip,
    speed_slip,
    speed_slip_from_odometer_slip,
)

SYSTEMS = (SlipIndicator, ExcessiveSlip, AdhesionDetector, CouplerRisk)

__all__ = [
    "DEGRADED",
    "NOMINAL",
    "SYSTEMS",
    "AdhesionDetector",
    "AdhesionMap",
    "CouplerRisk",
    "ExcessiveSlip",
    "SlipIndicator",
    "adhesion_map",
    "condition_of",
    "degraded_map",
    "indicator_level",
    "nominal_map",
    "odometer_slip",
    "odometer_slip_from_speed_slip",
    "published_map",
    "slip_filter_derivative",
    "speed_slip",
    "speed_slip_from_odometer_slip",
]
