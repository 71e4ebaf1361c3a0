"""Train observers: speed, position, slip and adhesion from effort, odometer and balises."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
