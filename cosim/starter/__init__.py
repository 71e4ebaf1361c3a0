"""Starter scenarios: a commented scenario file for an FMU, from what its description says. Nothing of the FMU is
executed.
"""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
