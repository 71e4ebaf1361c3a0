"""Observers of the small plants on which the theses show a method; nothing of a train."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
