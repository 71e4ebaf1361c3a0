"""Gives the components of a plan the interpolators that a run asks for."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cosim.coupling.plan import Plan
from cosim.coupling.planned import PlannedComponent
from cosim.master.interpolation.first_order_hold import FirstOrderHold, Method
from cosim.master.interpolation.interpolators import make_interpolator
from fmus.fmi.types import FLOATING_TYPES


def attach_interpolators(plan: Plan, method: Method) -> Mapping[str, str]:
    """Let all continuous connected inputs follow lines.

    Args:
        plan: prepared, components instantiated. method: as for `FirstOrderHold`.

    Returns:
        By component, the interpolator that tells it of its lines (see `interpolators`).
    """
    givers = _givers(plan)
    return {s.component.name: _attach(s, plan, givers, method) for s in plan.steps if len(s.inputs)}


def _attach(planned: PlannedComponent, plan: Plan, givers: list[PlannedComponent], method: Method) -> str:
    inputs, component = planned.inputs, planned.component
    continuous = np.array(
        [
            bool(plan.continuous[source]) and place not in inputs.tables and _is_continuous(planned, name)
            for place, (name, source) in enumerate(zip(inputs.names, inputs.sources, strict=True))
        ]
    )
    if not continuous.any():
        return "held"
    hold = FirstOrderHold(method, [givers[source].component for source in inputs.sources], continuous)
    planned.interpolator = make_interpolator(hold, inputs, component)
    plan.interpolators.append(planned.interpolator)
    return planned.interpolator.name


def _is_continuous(planned: PlannedComponent, name: str) -> bool:
    variable = planned.component.variables[name]
    return variable.type in FLOATING_TYPES and variable.variability in (None, "continuous")


def _givers(plan: Plan) -> list[PlannedComponent]:
    """The component that owns each column of the values."""
    return [step for step in plan.steps for _ in range(step.columns.stop - step.columns.start)]
