"""What a train measures: wheel odometer, balise reader, satellite positioning."""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
