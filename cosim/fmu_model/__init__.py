"""An FMU as a model: its states written and read, steps from any of them, and its linearisation."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
