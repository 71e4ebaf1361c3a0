"""How measurements travel in a train: the protocols of its network, and a network as a block."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
