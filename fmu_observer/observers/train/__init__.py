"""Train observers: speed, position, slip and adhesion from effort, odometer and balises."""

from fmu_observer.observers.train.differentiator_cdo import DifferentiatorCdo
from fmu_observer.observers.train.discrete_uio import DiscreteUio
from fmu_observer.observers.train.multirate_cdo import MultirateCdo
from fmu_observer.observers.train.takagi_sugeno_cdo import TakagiSugenoCdo
from fmu_observer.observers.train.train_observer import TrainObserver

SYSTEMS = (DifferentiatorCdo, TakagiSugenoCdo, MultirateCdo, DiscreteUio)

__all__ = ["SYSTEMS", "DifferentiatorCdo", "DiscreteUio", "MultirateCdo", "TakagiSugenoCdo", "TrainObserver"]
