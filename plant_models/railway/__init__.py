"""Railway plants: the train, its sensor, its driver, and the laws they are made of."""

from plant_models.railway.balise_reader import BaliseReader
from plant_models.railway.driver import Driver
from plant_models.railway.locomotive import Locomotive
from plant_models.railway.odometer import Odometer

__all__ = ["BaliseReader", "Driver", "Locomotive", "Odometer"]
