"""Observers that read a state, or what has changed, off the graphical signature of a window of samples."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
