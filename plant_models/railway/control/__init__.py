"""What drives: controllers that turn a speed profile and measurements into effort."""

from plant_models.railway.control.driver import Driver

SYSTEMS = (Driver,)

__all__ = ["SYSTEMS", "Driver"]
