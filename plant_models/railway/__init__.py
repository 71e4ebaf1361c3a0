"""Railway plants: what rolls, what it measures, what drives it, and the ground under it."""

from plant_models.railway import control, sensors, vehicle

SYSTEMS = (*vehicle.SYSTEMS, *sensors.SYSTEMS, *control.SYSTEMS)

__all__ = ["SYSTEMS"]
