"""Identification: parameters of a train from measured runs, with confidence intervals. Needs NumPy and
SciPy.
"""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
