"""What rolls: the single-mass train, the multi-vehicle train, and the forces on them."""

from plant_models.railway.vehicle.locomotive import Locomotive
from plant_models.railway.vehicle.train import Train

SYSTEMS = (Locomotive, Train)

__all__ = ["SYSTEMS", "Locomotive", "Train"]
