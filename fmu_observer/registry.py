"""The registry of observers and detectors: model name to class; options are constructor keywords."""

from __future__ import annotations

from fmu_observer import detection
from fmu_observer.observers import train
from plant_models.hybrid import HybridSystem

OBSERVERS: dict[str, type[HybridSystem]] = {system.name: system for system in (*train.SYSTEMS, *detection.SYSTEMS)}
