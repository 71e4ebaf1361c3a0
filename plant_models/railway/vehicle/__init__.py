"""What rolls: the single-mass train, the multi-vehicle train, and the forces on them."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
