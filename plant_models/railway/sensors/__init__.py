"""What a train measures: wheel odometer, balise reader."""

from plant_models.railway.sensors.balise_reader import BaliseReader
from plant_models.railway.sensors.odometer import Odometer

SYSTEMS = (Odometer, BaliseReader)

__all__ = ["SYSTEMS", "BaliseReader", "Odometer"]
