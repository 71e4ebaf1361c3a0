"""Observers that live at the samples only."""

from fmu_observer.observers.discrete.discrete_luenberger import DiscreteLuenberger
from fmu_observer.observers.discrete.extended_kalman_filter import ExtendedKalmanFilter
from fmu_observer.observers.discrete.extended_luenberger import ExtendedLuenberger
from fmu_observer.observers.discrete.implicit_differentiator import ImplicitDifferentiator
from fmu_observer.observers.discrete.kalman_filter import KalmanFilter

SYSTEMS = (ImplicitDifferentiator, DiscreteLuenberger, KalmanFilter, ExtendedLuenberger, ExtendedKalmanFilter)

__all__ = [
    "SYSTEMS",
    "DiscreteLuenberger",
    "ExtendedKalmanFilter",
    "ExtendedLuenberger",
    "ImplicitDifferentiator",
    "KalmanFilter",
]
