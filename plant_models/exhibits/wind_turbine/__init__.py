"""The wind turbine of the benchmark on fault detection: wind, turbine with its sensors, controller."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
