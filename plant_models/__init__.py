"""What a train does: hybrid systems in plain NumPy. Knows no FMI, no observer, no master."""

from plant_models.hybrid import HybridSystem
from plant_models.railway import BaliseReader, Driver, Locomotive, Odometer

PLANTS: dict[str, type[HybridSystem]] = {plant.name: plant for plant in (Locomotive, Odometer, Driver, BaliseReader)}

__all__ = ["PLANTS", "BaliseReader", "Driver", "Locomotive", "Odometer"]
