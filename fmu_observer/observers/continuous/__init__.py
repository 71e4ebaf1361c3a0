"""Observers whose measurements are there at all times."""

from fmu_observer.observers.continuous.filtering_differentiator import FilteringDifferentiator
from fmu_observer.observers.continuous.high_gain import HighGain
from fmu_observer.observers.continuous.levant_differentiator import LevantDifferentiator
from fmu_observer.observers.continuous.luenberger import Luenberger
from fmu_observer.observers.continuous.takagi_sugeno_luenberger import TakagiSugenoLuenberger
from fmu_observer.observers.continuous.thau import Thau

SYSTEMS = (Luenberger, Thau, HighGain, LevantDifferentiator, FilteringDifferentiator, TakagiSugenoLuenberger)

__all__ = [
    "SYSTEMS",
    "FilteringDifferentiator",
    "HighGain",
    "LevantDifferentiator",
    "Luenberger",
    "TakagiSugenoLuenberger",
    "Thau",
]
