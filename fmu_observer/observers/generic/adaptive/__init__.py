"""Adaptive observers of state-affine models with unknown constants, corrected by samples."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
