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
    "fmu_observer.observers.sampled",
    "fmu_observer.observers.continuous",
    "fmu_observer.observers.discrete",
    "fmu_observer.observers.traction",
    "fmu_observer.observers.signature",
    "fmu_observer.detection",
)

OBSERVERS: Registry[type[HybridSystem]] = Registry("observer", ROOMS, "fmu_observer.observers", SYSTEM)
"""Observers and detectors: model name to class; options are constructor keywords."""

__all__ = ["OBSERVERS"]
