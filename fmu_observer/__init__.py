"""What the train believes: observers, detectors, their certificates, and the FMU-style interface over any of them.

Importing this package costs nothing: observers are loaded when they are asked for. It may use `plant_models`, never
`fmus` or `cosim`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_models import SYSTEM
from plant_models.registry import Registry

if TYPE_CHECKING:
    from plant_models.hybrid.system import HybridSystem

ROOMS = (
    "fmu_observer.observers.train",
    "fmu_observer.observers.generic.continuous",
    "fmu_observer.observers.generic.discrete",
    "fmu_observer.observers.generic.sampled",
    "fmu_observer.observers.generic.adaptive",
    "fmu_observer.observers.generic.delayed",
    "fmu_observer.observers.generic.differentiators",
    "fmu_observer.observers.generic.signature",
    "fmu_observer.observers.motors",
    "fmu_observer.observers.exhibits",
    "fmu_observer.detection",
)

OBSERVERS: Registry[type[HybridSystem]] = Registry("observer", ROOMS, "fmu_observer.observers", SYSTEM)
"""Observers and detectors: model name to class; options are constructor keywords."""

__all__ = ["OBSERVERS"]
