"""Starter scenarios: a commented scenario file for an FMU, from what its description says, and from short
runs of one that says too little.
"""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
