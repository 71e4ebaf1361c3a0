"""What pulls a train: traction motors, their control, and the transforms between their frames."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
