"""The coupler between two vehicles: spring and damper, with free play and pre-load where they are wanted.

Plain NumPy on numbers, batches and traced symbols. Knows nothing of vehicles and trains.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import Array, Signal, parameter

COUPLER_PARAMETERS: tuple[Signal, ...] = (
    parameter("coupler_stiffness", "N/m", 2.5e6, "Stiffness of a coupler K", min=0.0),
    parameter(
        "coupler_damping", "N.s/m", 5e4, "Damping of a coupler D; negative is the printed sign of (4.6), unstable"
    ),
    parameter("coupler_free_play", "m", 0.0, "Total way of a coupler between pulling and pushing", min=0.0),
    parameter("coupler_preload", "N", 0.0, "Force below which the spring of a coupler does not give way", min=0.0),
    parameter(
        "coupler_preload_stiffness",
        "N/m",
        5e7,
        "Stiffness of a coupler below its pre-load: that of frames and drawbars",
        min=1.0,
    ),
)


def coupler_force(elongation: Array, rate: Array, p: Any) -> Array:
    """Force in a coupler, tension positive: ``K e + D de`` without free play and pre-load [N].

    With free play s the spring is loose while ``|e| < s/2`` and counts its deformation from there. A loose coupler has
    no damper either, and a damper alone cannot make a pulling coupler push, or a pushing one pull.

    With pre-load F0 the coupler is stiff (`coupler_preload_stiffness` K0) up to F0 and gives way with K beyond: at rest
    under a force ``F > F0`` its elongation is ``s/2 + F0/K0 + (F - F0)/K``.

    Args:
        elongation: beyond the neutral place e [m], any shape. rate: its derivative [m/s], the same shape.
        p: parameters with `COUPLER_PARAMETERS`.

    Source: Bouchama 2024, (4.6), whose damping sign makes every mode of the train unstable and is repaired here; free
    play and pre-load are ours.
    """
    # Without free play or pre-load the kinks below would all lie at zero elongation, where the derivative is that of
    # the spring.
    half = 0.5 * p.coupler_free_play
    deformation = np.where(half > 0.0, elongation - np.clip(elongation, -half, half), elongation)
    stiff = p.coupler_preload / p.coupler_preload_stiffness
    bent = np.where(stiff > 0.0, np.clip(deformation, -stiff, stiff), 0.0)
    spring = p.coupler_preload_stiffness * bent + p.coupler_stiffness * (deformation - bent)
    force = spring + p.coupler_damping * rate
    pulling, pushing = np.maximum(force, 0.0), np.minimum(force, 0.0)
    one_sided = np.where(deformation > 0.0, pulling, np.where(deformation < 0.0, pushing, 0.0))
    return np.where(half > 0.0, one_sided, force)
