"""What a train does: hybrid systems in plain NumPy. Knows no FMI, no observer, no master."""

from plant_models import railway
from plant_models.hybrid import HybridSystem
from plant_models.railway.control import Driver
from plant_models.railway.sensors import BaliseReader, Odometer
from plant_models.railway.vehicle import Locomotive

PLANTS: dict[str, type[HybridSystem]] = {plant.name: plant for plant in railway.SYSTEMS}

__all__ = ["PLANTS", "BaliseReader", "Driver", "Locomotive", "Odometer"]
