"""The small academic plants on which observers are shown."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
