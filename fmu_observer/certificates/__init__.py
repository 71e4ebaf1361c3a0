"""Certificates: exact stability checks of sampled observers, recomputed in NumPy and never taken from a solver's
status.
"""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
