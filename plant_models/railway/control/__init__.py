"""What drives: controllers that turn a speed profile and measurements into effort, and the profiles they follow."""

from plant_models.railway.control.adrc_controller import AdrcController
from plant_models.railway.control.anti_slip_device import AntiSlipDevice
from plant_models.railway.control.driver import Driver
from plant_models.railway.control.mdpe_controller import MdpeController
from plant_models.railway.control.mission import Mission

SYSTEMS = (Driver, Mission, AdrcController, MdpeController, AntiSlipDevice)

__all__ = ["SYSTEMS", "AdrcController", "AntiSlipDevice", "Driver", "MdpeController", "Mission"]
