"""Localisation: which method finds the crossings. `choose` takes the best one that the probed plant allows.

| method | needs | error |
|---|---|---|
| ``early-return`` | an FMI 3 plant with event mode that reports the crossing itself | the plant's own |
| ``rollback`` | an exact state and steps of any length | root search on re-done steps |
| ``predict`` | steps of any length | interpolation over the last short cut |
| ``interpolate`` | nothing | cubic over the step; the bound is reported |
"""

from __future__ import annotations

from cosim.balises.early_return import EarlyReturnLocaliser
from cosim.balises.interpolate import InterpolateLocaliser
from cosim.balises.layout import InstantLayout, TrackLayout
from cosim.balises.localiser import METHODS, Localiser, Method
from cosim.balises.plant_monitor import PlantMonitor
from cosim.balises.predict import PredictLocaliser
from cosim.balises.rollback import RollbackLocaliser
from cosim.errors import CouplingError
from fmus.check.restoring import Restores

__all__ = ["METHODS", "Localiser", "Method", "choose", "make_localiser"]


def choose(honest_step: bool, restores: Restores, clock: str | None) -> tuple[Method, str]:
    """The best method a probed plant allows, and why.

    Args:
        honest_step: steps of any length were seen to do what they say.
        restores: how what followed a restored state was seen to continue.
        clock: output clock that reports crossings, where the scenario names one.
    """
    if clock is not None:
        return "early-return", f"the plant reports crossings on its clock '{clock}'"
    if restores == "exact" and honest_step:
        return "rollback", "the plant restores its state exactly and takes steps of any length"
    if honest_step:
        how = "only to within its solver's tolerance" if restores == "within_tolerance" else "not"
        return "predict", f"the plant takes steps of any length, its state is restored {how}"
    return "interpolate", "the plant does not take steps of any length reliably"


def make_localiser(
    method: Method,
    watch: PlantMonitor,
    layout: TrackLayout | InstantLayout,
    clock: str | None = None,
    jerk_bound: float = 10.0,
) -> Localiser:
    """A localiser by name.

    Args:
        watch: the monitored plant. layout: where the balises are.
        clock: name of the plant's clock that announces crossings. jerk_bound: largest jerk of the plant [m/s3].

    Raises:
        CouplingError: the method is unknown, or needs something the plant or the scenario does not have.
    """
    if method == "early-return":
        if clock is None:
            raise CouplingError("balises.method = 'early-return' needs balises.clock, the plant's output clock.")
        return EarlyReturnLocaliser(watch, layout, clock)
    if method == "rollback":
        if not watch.component.can_save:
            raise CouplingError(
                f"balises.method = 'rollback': {watch.component.name} cannot save its state; use 'auto'."
            )
        return RollbackLocaliser(watch, layout)
    if method == "predict":
        return PredictLocaliser(watch, layout)
    if method == "interpolate":
        return InterpolateLocaliser(watch, layout, jerk_bound)
    raise CouplingError(f"balises.method {method!r} is unknown; use 'auto' or one of {', '.join(METHODS)}.")
