"""To and from python-control: a hybrid system as its objects, and its objects as hybrid systems.

``control`` is imported when something is converted, not before. Knows the hybrid foundation and no vehicle.
"""

from plant_models.interop.continuous_part import left_out
from plant_models.interop.from_control import ControlSystem, from_nonlinear_io, from_state_space
from plant_models.interop.operating_point import OperatingPoint, OperatingPointError, operating_point
from plant_models.interop.to_control import to_nonlinear_io, to_state_space

__all__ = [
    "ControlSystem",
    "OperatingPoint",
    "OperatingPointError",
    "from_nonlinear_io",
    "from_state_space",
    "left_out",
    "operating_point",
    "to_nonlinear_io",
    "to_state_space",
]
