"""Adhesion between wheel and rail: curves over slip and speed, and the laws a plant chooses from."""

from plant_models.railway.adhesion.burckhardt import BURCKHARDT_DEGRADED, BURCKHARDT_NOMINAL, BurckhardtCurve
from plant_models.railway.adhesion.law import ADHESION_LAWS, AdhesionLaw, BurckhardtLaw, PolachLaw
from plant_models.railway.adhesion.polach import CREEP_STIFFNESS, POLACH_DRY, POLACH_WET, PolachCurve

__all__ = [
    "ADHESION_LAWS",
    "BURCKHARDT_DEGRADED",
    "BURCKHARDT_NOMINAL",
    "CREEP_STIFFNESS",
    "POLACH_DRY",
    "POLACH_WET",
    "AdhesionLaw",
    "BurckhardtCurve",
    "BurckhardtLaw",
    "PolachCurve",
    "PolachLaw",
]
