"""Train observers: speed, position, slip and adhesion from effort, odometer and balises, as hybrid systems."""

from fmu_observer.observers.differentiator_cdo import DifferentiatorCdo
from fmu_observer.observers.discrete_uio import DiscreteUio
from fmu_observer.observers.multirate_cdo import MultirateCdo
from fmu_observer.observers.takagi_sugeno_cdo import TakagiSugenoCdo
from fmu_observer.observers.train_observer import TrainObserver

__all__ = ["DifferentiatorCdo", "DiscreteUio", "MultirateCdo", "TakagiSugenoCdo", "TrainObserver"]
