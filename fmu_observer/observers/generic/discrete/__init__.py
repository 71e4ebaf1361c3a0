"""Observers that live at the samples only."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
