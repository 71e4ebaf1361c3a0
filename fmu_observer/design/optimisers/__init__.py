"""Optimisers behind one interface: they ask for the costs of candidates and are told them. They know no filter and no
scenario.
"""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
