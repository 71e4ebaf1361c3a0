"""Filters whose model is a sealed FMU: components of a scenario."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
