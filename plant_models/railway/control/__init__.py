"""What drives: controllers that turn a speed profile and measurements into effort, and the profiles they follow."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
