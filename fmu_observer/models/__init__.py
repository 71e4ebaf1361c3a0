"""What an observer believes of its plant: equations, signals, constants. No observer and no gain lives here."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
