"""What stands between any two components: faults of a signal."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
