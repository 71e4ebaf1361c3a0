"""Linearising a system of ours: its exact Jacobians with the names, units and words of a linearised FMU."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cosim.fmu_model.linearisation import Linearisation
from cosim.fmu_model.sealed import FmuModelError
from plant_models.hybrid import HybridSystem
from plant_models.interop.continuous_part import ContinuousPart, filled, left_out
from plant_models.interop.to_control import jacobians


def linearise_system(
    system: HybridSystem,
    *,
    t: float = 0.0,
    states: Mapping[str, float] | None = None,
    inputs: Mapping[str, float] | None = None,
    parameters: Mapping[str, float] | None = None,
    preset: str | None = None,
) -> Linearisation:
    """Matrices of a system of ours by its exact traced Jacobians.

    Args:
        system: a traceable hybrid system. t: instant [s]. states, inputs, parameters: values by name; those left out
            at their starts. preset: of the parameters; None for the default one.

    Returns:
        The linearisation.

    Raises:
        FmuModelError: a name is unknown, or nothing in it is continuous.
    """
    try:
        part = ContinuousPart(system, preset, parameters)
        x = filled(dict(zip(part.states, part.start_state, strict=True)), states, f"{system.name}: state")
        u = filled(dict(zip(part.inputs, part.start_inputs, strict=True)), inputs, f"{system.name}: input")
    except ValueError as error:
        raise FmuModelError(str(error)) from error
    if not part.states:
        raise FmuModelError(
            f"{system.name}: it has no continuous states, so nothing of it can be linearised; name a model with states."
        )
    signals = (*system.states, *system.inputs, *system.outputs)
    return Linearisation(
        system.name,
        *jacobians(part, x, u, t),
        states=tuple(part.states),
        inputs=tuple(part.inputs),
        outputs=tuple(part.outputs),
        units={name: signal.unit for signal in signals for name in signal.scalar_names},
        t=t,
        x=x,
        u=u,
        y=np.asarray(part.output(t, x, u, part.parameters), dtype=float),
        rates=np.asarray(part.derivative(t, x, u, part.parameters), dtype=float),
        step=0.0,
        method="exact Jacobians",
        remarks=() if not system.events else (left_out(system),),
    )
