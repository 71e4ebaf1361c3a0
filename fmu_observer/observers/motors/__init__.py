"""Observers of traction motors: speed, angle and load from voltages and currents."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
