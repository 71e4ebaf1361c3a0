"""What a train measures: wheel odometer, balise reader, satellite positioning."""

from plant_models.railway.sensors.balise_reader import BaliseReader
from plant_models.railway.sensors.gps import Gps
from plant_models.railway.sensors.odometer import Odometer

SYSTEMS = (Odometer, BaliseReader, Gps)

__all__ = ["SYSTEMS", "BaliseReader", "Gps", "Odometer"]
