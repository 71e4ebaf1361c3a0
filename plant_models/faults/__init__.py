"""What stands between any two components: faults of a signal, of a wheel."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
