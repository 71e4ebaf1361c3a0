"""Train observers: speed, position, slip and adhesion from effort, odometer and balises."""

from fmu_observer.observers.train.adaptive_gain_cdo import AdaptiveGainCdo
from fmu_observer.observers.train.augmented_high_gain_cdo import AugmentedHighGainCdo
from fmu_observer.observers.train.augmented_takagi_sugeno_cdo import AugmentedTakagiSugenoCdo
from fmu_observer.observers.train.differentiator_cdo import DifferentiatorCdo
from fmu_observer.observers.train.discrete_uio import DiscreteUio
from fmu_observer.observers.train.multirate_cdo import MultirateCdo
from fmu_observer.observers.train.takagi_sugeno_cdo import TakagiSugenoCdo
from fmu_observer.observers.train.train_observer import TrainObserver

SYSTEMS = (
    DifferentiatorCdo,
    TakagiSugenoCdo,
    MultirateCdo,
    DiscreteUio,
    AugmentedHighGainCdo,
    AugmentedTakagiSugenoCdo,
    AdaptiveGainCdo,
)

__all__ = [
    "SYSTEMS",
    "AdaptiveGainCdo",
    "AugmentedHighGainCdo",
    "AugmentedTakagiSugenoCdo",
    "DifferentiatorCdo",
    "DiscreteUio",
    "MultirateCdo",
    "TakagiSugenoCdo",
    "TrainObserver",
]
