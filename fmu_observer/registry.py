"""The registry of observers and detectors: model name to class; options are constructor keywords."""

from __future__ import annotations

from fmu_observer.observers import DifferentiatorCdo, DiscreteUio, MultirateCdo, TakagiSugenoCdo
from fmu_observer.slip import SlipIndicator
from plant_models.hybrid import HybridSystem

OBSERVERS: dict[str, type[HybridSystem]] = {
    system.name: system for system in (DifferentiatorCdo, TakagiSugenoCdo, MultirateCdo, DiscreteUio, SlipIndicator)
}
