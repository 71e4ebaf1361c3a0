"""Gives the components of a plan the interpolators that a run asks for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np

from cosim.components.recording import RecordingComponent
from cosim.coupling.plan import Plan
from cosim.coupling.planned import PlannedComponent
from cosim.master.interpolation.first_order_hold import FirstOrderHold, KnownInputs, Method
from cosim.master.interpolation.interpolators import make_interpolator
from fmus.fmi.types import is_continuous


def attach_interpolators(plan: Plan, method: Method | Literal["hold"]) -> Mapping[str, str]:
    """Let all continuous connected inputs follow lines; those of columns of tables do so whatever the method.

    Args:
        plan: prepared, components instantiated. method: as for `FirstOrderHold`; ``hold`` for no other lines.

    Returns:
        By component, the interpolator that gives it its lines (see `interpolators`).
    """
    givers = [step for step in plan.steps for _ in range(step.columns.stop - step.columns.start)]
    return {s.component.name: _attach(s, plan, givers, method) for s in plan.steps if len(s.inputs)}


def _attach(
    planned: PlannedComponent, plan: Plan, givers: list[PlannedComponent], method: Method | Literal["hold"]
) -> str:
    inputs, component = planned.inputs, planned.component
    known = _known(planned, plan, givers)
    ahead = {place for one in known for place in one.places.tolist()}
    continuous = np.array(
        [
            place in ahead
            or (
                method != "hold"
                and source < len(givers)  # what a network delivers is held
                and bool(plan.continuous[source])
                and place not in inputs.tables
                and is_continuous(component.variables[name])
            )
            for place, (name, source) in enumerate(zip(inputs.names, inputs.sources, strict=True))
        ]
    )
    if not continuous.any():
        return "held"
    sources = [givers[source].component if source < len(givers) else component for source in inputs.sources]
    hold = FirstOrderHold("interpolate" if method == "hold" else method, sources, continuous, known)
    planned.interpolator = make_interpolator(hold, inputs, component)
    plan.interpolators.append(planned.interpolator)
    return planned.interpolator.name


def _known(planned: PlannedComponent, plan: Plan, givers: list[PlannedComponent]) -> list[KnownInputs]:
    """The inputs whose course is known ahead, by the recording that plays them back: lines, and samples of tables."""
    inputs = planned.inputs
    by_source: dict[str, list[int]] = {}
    for place, source in enumerate(inputs.sources.tolist()):
        name, _, signal = plan.signals[source].name.partition(".")
        giver = givers[source].component if source < len(givers) else None
        if isinstance(giver, RecordingComponent) and giver.course_of(
            signal, sampled=planned.component.can_be_missing(inputs.names[place])
        ):
            by_source.setdefault(name, []).append(place)
    found = []
    for name, members in by_source.items():
        recording, places = plan.find(name).component, np.array(members, dtype=np.intp)
        assert isinstance(recording, RecordingComponent)
        names = [plan.signals[inputs.sources[place]].name.removeprefix(f"{name}.") for place in members]
        found.append(KnownInputs(places, recording.course(names), inputs.factors[places], inputs.offsets[places]))
    return found
