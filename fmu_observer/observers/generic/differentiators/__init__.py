"""Differentiators of a signal, as systems."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
