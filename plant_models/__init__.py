"""What a train does: hybrid systems in plain NumPy. Knows no FMI, no observer, no master."""

from plant_models import benchmarks, railway
from plant_models.hybrid import HybridSystem
from plant_models.railway.control import Driver
from plant_models.railway.sensors import BaliseReader, Gps, Odometer
from plant_models.railway.vehicle import Locomotive, Train

PLANTS: dict[str, type[HybridSystem]] = {plant.name: plant for plant in (*railway.SYSTEMS, *benchmarks.SYSTEMS)}

__all__ = ["PLANTS", "BaliseReader", "Driver", "Gps", "Locomotive", "Odometer", "Train"]
