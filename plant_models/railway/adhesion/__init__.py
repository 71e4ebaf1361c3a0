"""Adhesion between wheel and rail: curves over slip and speed, and the laws a plant chooses from."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
