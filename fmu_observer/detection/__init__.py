"""Detection: the two slip ratios, slip indicators, the adhesion condition, and the risk of a coupler to break."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
