"""What goes wrong on a train on its way from the rail to the reading: faults of the wheel."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
