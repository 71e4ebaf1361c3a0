"""What rolls: the single-mass train, and the forces on it."""

from plant_models.railway.vehicle.locomotive import Locomotive

SYSTEMS = (Locomotive,)

__all__ = ["SYSTEMS", "Locomotive"]
