"""Observers of a model whose measurements come late, node by node."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
