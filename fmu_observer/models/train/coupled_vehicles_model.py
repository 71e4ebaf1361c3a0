"""A locomotive and a wagon behind a coupler, the effort not quite known: unknown-input observers of two measurements.
Data only.
"""

from __future__ import annotations

import numpy as np

from fmu_observer.models.observer_model import ObserverModel
from fmu_observer.models.suitability import require_mass
from plant_models.hybrid import input_signal, state

_LOCOMOTIVE, _WAGON = 90e3, 60e3  # [kg]
_STIFFNESS, _DAMPING = 2.5e6, 5e4  # of the coupler [N/m], [N.s/m]
DRAG = 2e-3  # slope of the running resistance per mass [1/s]
_BEYOND = "Acceleration by effort beyond the one that was told"
_STATES = (
    state("elongation", "m", 0.0, "Elongation of the coupler"),
    state("speed", "m/s", 10.0, "Speed of the locomotive"),
    state("wagon_speed", "m/s", 10.0, "Speed of the wagon"),
)


def coupled_vehicles(
    mass: float = _LOCOMOTIVE,
    wagon_mass: float = _WAGON,
    drag: float = DRAG,
    effort: float = 1.0,
    stiffness: float = _STIFFNESS,
    damping: float = _DAMPING,
) -> ObserverModel:
    """``de = v1 - v2``, ``dv1 = (b u - F) / m1 - r v1 + d``, ``dv2 = F / m2 - r v2``, ``F = K e + D (v1 - v2)`` [ours].

    Both speeds are measured; the elongation e of the coupler is not, and the effort differs from the command u by an
    unknown ``m1 d``, a wheel that slides or a brake that fails. The smallest train on which decoupling shows
    something: the coupler is known from the wagon's speed, whatever the locomotive's wheels do.

    Args:
        mass: m1 [kg]. wagon_mass: m2 [kg]. drag: r, slope of the resistance per mass [1/s]. effort: force per effort, b
            [1]. stiffness: K [N/m]. damping: D [N.s/m].
    """
    require_mass("coupled_vehicles", mass=mass, wagon_mass=wagon_mass)
    first = [-stiffness / mass, -damping / mass - drag, damping / mass]
    second = [stiffness / wagon_mass, damping / wagon_mass, -damping / wagon_mass - drag]
    return ObserverModel(
        name="coupled_vehicles",
        description="Locomotive and wagon behind a coupler, both speeds measured, the effort not quite known",
        source="ours, for Aguiar Cota 2019, (2.11)",
        states=_STATES,
        inputs=(input_signal("effort", "N", 0.0, "Effort that the locomotive was told: traction > 0, brake < 0"),),
        measurements=tuple(input_signal(s.name, s.unit, s.start, s.description) for s in _STATES[1:]),
        A=np.array([[0.0, 1.0, -1.0], first, second]),
        B=np.array([[0.0], [effort / mass], [0.0]]),
        C=np.eye(3)[1:],
        sample_period=0.1,
        unknown_inputs=(input_signal("acceleration_error", "m/s2", 0.0, _BEYOND),),
        H=np.array([[0.0], [1.0], [0.0]]),
    )
