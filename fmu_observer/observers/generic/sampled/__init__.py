"""Continuous-discrete observers: they flow between samples and are corrected by them."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
