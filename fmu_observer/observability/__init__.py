"""Do the measurements determine the states? Modes no sensor sees, and the Gramian over an actual pattern of balises.

Linear algebra on matrices; they come from the user, from an observer model, or from a hybrid system at an operating
point.
"""

from fmu_observer.observability.gramian import Observability, observability, observability_gramian
from fmu_observer.observability.measured_system import MeasuredSystem
from fmu_observer.observability.modes import (
    Mode,
    UnobservableError,
    require_detectable,
    require_observable,
    undetectable_modes,
    unobservable_modes,
)
from fmu_observer.observability.pattern import SamplePattern
from fmu_observer.observability.sources import (
    measured_model,
    measured_plant,
    require_detectable_model,
    require_detectable_vertices,
)

__all__ = [
    "MeasuredSystem",
    "Mode",
    "Observability",
    "SamplePattern",
    "UnobservableError",
    "measured_model",
    "measured_plant",
    "observability",
    "observability_gramian",
    "require_detectable",
    "require_detectable_model",
    "require_detectable_vertices",
    "require_observable",
    "undetectable_modes",
    "unobservable_modes",
]
