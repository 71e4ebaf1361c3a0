"""Observers whose measurements are there at all times."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
