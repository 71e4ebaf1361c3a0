"""Theorem 7 for the train observer `takagi_sugeno_cdo`: gains for a longest gap and a decay, as its parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fmu_observer.design.theorem7.theorem7_design import Theorem7Design, design_theorem7
from fmu_observer.models.train.takagi_sugeno_train_model import takagi_sugeno_train
from fmu_observer.observers.parameter_values import Value, parameter_values
from fmu_observer.observers.train.takagi_sugeno_cdo import TakagiSugenoCdo


def design_train_gains(
    max_gap: float, eta: float, parameters: Mapping[str, Value] | None = None, **options: Any
) -> tuple[dict[str, Any], Theorem7Design]:
    """Gains of the observer `takagi_sugeno_cdo` with the least gamma for balise gaps up to `max_gap`.

    With the disturbance channel the odometer is trusted, so that its slip biases the estimate; without it
    (``disturbance=False``) the design leaves the odometer out, as the gains (3.48) do.

    Args:
        max_gap: longest gap between balises [s]. eta: decay of the balise gain [1/s].
        parameters: values of the observer that replace its defaults: mass, davis_b, davis_c, premise_min, premise_max.
        options: as of `design_theorem7`.

    Returns:
        Parameters for the observer by name, and the design with its margins.

    Raises:
        InfeasibleDesign: there is no solution; the message says the nearest feasible eta and gap.
        ValueError: a parameter is unknown or not legal.
    """
    observer = TakagiSugenoCdo()
    p = observer.unpack_parameters(parameter_values(observer, parameters, purpose="to design for"))
    model = takagi_sugeno_train(*(float(v) for v in (p.mass, p.davis_b, p.davis_c, p.premise_min, p.premise_max)))
    design = design_theorem7(model, max_gap, eta, **options)
    balise, odometer = design.sampled_gain[:, :, 0], design.continuous_gain[:, :, 0]
    values: dict[str, Any] = {"innovation_decay": eta}
    for kind, gain in (("balise", balise), ("odometer", odometer)):
        for i, state in enumerate(("position", "speed")):
            values[f"{kind}_gain_{state}"] = tuple(map(float, gain[:, i]))
    return values, design
