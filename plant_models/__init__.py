"""What a train does: hybrid systems in plain NumPy. Knows no FMI, no observer, no master.

Importing this package costs nothing: plants are loaded when they are asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from plant_models.registry import Registry, load

if TYPE_CHECKING:
    from plant_models.faults.fault_cause import FaultCause
    from plant_models.hybrid.system import HybridSystem
    from plant_models.railway.control.driver import Driver
    from plant_models.railway.sensors.balise_reader import BaliseReader
    from plant_models.railway.sensors.gps import Gps
    from plant_models.railway.sensors.odometer import Odometer
    from plant_models.railway.vehicle.locomotive import Locomotive
    from plant_models.railway.vehicle.train import Train

ROOMS = (
    "plant_models.railway.vehicle",
    "plant_models.railway.sensors",
    "plant_models.railway.traction",
    "plant_models.railway.network",
    "plant_models.railway.control",
    "plant_models.faults",
    "plant_models.exhibits",
    "plant_models.exhibits.wind_turbine",
)
SYSTEM = "plant_models.hybrid.system:HybridSystem"

PLANTS: Registry[type[HybridSystem]] = Registry("plant", ROOMS, "plant_models.plants", SYSTEM)
"""Plants, sensors and drivers: model name to class; options are constructor keywords."""

FAULT_CAUSES: Registry[type[FaultCause]] = Registry(
    "fault cause",
    ("plant_models.faults.causes",),
    "plant_models.fault_causes",
    "plant_models.faults.fault_cause:FaultCause",
)
"""Causes of faults by name: what the option `cause` of `wheel_fault` and `signal_fault` takes."""

__all__ = ["FAULT_CAUSES", "PLANTS", "BaliseReader", "Driver", "Gps", "Locomotive", "Odometer", "Train"]


def __dir__() -> list[str]:
    return sorted(__all__)


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = {member.target.partition(":")[2]: member.target for (member, *_) in PLANTS.members.values()}
    return load(found[name])
