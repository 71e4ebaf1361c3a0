"""Continuous-discrete observers: they flow between samples and are corrected by them."""

from fmu_observer.observers.sampled.exponential_gain import ExponentialGain
from fmu_observer.observers.sampled.held_innovation import HeldInnovation
from fmu_observer.observers.sampled.hybrid_impulsive import HybridImpulsive
from fmu_observer.observers.sampled.multirate_sylvester import MultirateSylvester
from fmu_observer.observers.sampled.output_predictor import OutputPredictor
from fmu_observer.observers.sampled.riccati_high_gain import RiccatiHighGain
from fmu_observer.observers.sampled.takagi_sugeno_aperiodic import TakagiSugenoAperiodic
from fmu_observer.observers.sampled.takagi_sugeno_cdo import GeneralTakagiSugenoCdo
from fmu_observer.observers.sampled.takagi_sugeno_periodic import TakagiSugenoPeriodic

SYSTEMS = (
    RiccatiHighGain,
    TakagiSugenoPeriodic,
    MultirateSylvester,
    OutputPredictor,
    HeldInnovation,
    ExponentialGain,
    HybridImpulsive,
    TakagiSugenoAperiodic,
    GeneralTakagiSugenoCdo,
)

__all__ = [
    "SYSTEMS",
    "ExponentialGain",
    "GeneralTakagiSugenoCdo",
    "HeldInnovation",
    "HybridImpulsive",
    "MultirateSylvester",
    "OutputPredictor",
    "RiccatiHighGain",
    "TakagiSugenoAperiodic",
    "TakagiSugenoPeriodic",
]
