"""The registry of observers and detectors: model name to class; options are constructor keywords."""

from __future__ import annotations

from fmu_observer import detection
from fmu_observer.observers import continuous, discrete, sampled, train
from plant_models.hybrid import HybridSystem

ROOMS = (train, sampled, continuous, discrete, detection)

OBSERVERS: dict[str, type[HybridSystem]] = {system.name: system for room in ROOMS for system in room.SYSTEMS}
