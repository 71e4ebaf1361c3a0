"""Studies: one scenario run several times with something varied."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
