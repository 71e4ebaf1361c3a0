"""Calibration: parameters of an FMU or a scenario from recordings, with confidence regions."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
