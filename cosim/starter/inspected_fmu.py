"""An FMU inspected: its variables as signals to guess from. Reads the model description; nothing is unpacked or
executed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fmpy.model_description import ModelDescription, ModelVariable

from cosim.components.component import Component
from cosim.components.description import demand_steppable, read_description, runs_here
from cosim.components.loading import describe_fmu
from cosim.components.stated_units import NONE_STATED, StatedUnit
from cosim.starter.guessed_signal import GuessedSignal
from fmus.fmi.elements import elements_of
from fmus.fmi.types import NUMERIC_TYPES
from plant_models.hybrid.units import UnitError

NAME = "fmu"
_LARGEST_ARRAY = 16
"""Elements of longer arrays are not inspected one by one."""


@dataclass(frozen=True)
class InspectedFmu:
    """What an FMU says of itself.

    Args:
        path: of the file. component: to be asked for variables and units; it cannot be stepped.
        inputs, outputs, parameters, hidden: numeric scalars, and the elements of short arrays; hidden ones are local
            variables, which may be read like outputs.
        unread: inputs and outputs that no connection of numbers can reach (texts, clocks, long arrays), a line each.
        runs_here: ``yes``, or why it cannot run on this machine.
    """

    path: Path
    component: Component
    inputs: Sequence[GuessedSignal]
    outputs: Sequence[GuessedSignal]
    parameters: Sequence[GuessedSignal]
    hidden: Sequence[GuessedSignal]
    unread: Sequence[str]
    runs_here: str

    @property
    def description(self) -> ModelDescription:
        """The model description."""
        return self.component.description


def inspect_fmu(path: Path, units: Mapping[str, StatedUnit] = NONE_STATED) -> InspectedFmu:
    """Inspect an FMU.

    Args:
        path: of the FMU. units: what is stated of its variables, by name.

    Raises:
        FmuLoadError: it is missing, broken, or not made for co-simulation. CouplingError: `units` do not fit it.
    """
    demand_steppable(read_description(path, path.name), str(path))
    component = describe_fmu(path, NAME, units)
    found: dict[str, list[GuessedSignal]] = {"input": [], "output": [], "parameter": [], "local": []}
    unread: list[str] = []
    hidden = component.event_references()
    for variable in component.description.modelVariables:
        if variable.causality not in found or variable.valueReference in hidden:
            continue
        signals = _signals(component, variable, units.get(variable.name))
        found[variable.causality] += signals
        if not signals and variable.causality in ("input", "output"):
            unread.append(_unread(variable))
    return InspectedFmu(
        path, component, found["input"], found["output"], found["parameter"], found["local"], unread, runs_here(path)
    )


def _signals(component: Component, variable: ModelVariable, fact: StatedUnit | None) -> list[GuessedSignal]:
    if variable.type not in NUMERIC_TYPES:
        return []
    elements = elements_of(variable) if variable.shape else [None]
    if len(elements) > _LARGEST_ARRAY:
        return []
    unit = component.unit_name(variable.name)
    try:
        meaning = component.unit(variable.name)
    except UnitError:
        meaning = None
    start = None if variable.shape else number(variable.start)
    names = [variable.name if element is None else element.name for element in elements]
    description, stated = variable.description or "", (fact and fact.meaning) or ""
    known = (unit, meaning if unit else None, description, start, str(variable.type), stated)
    return [GuessedSignal(name, *known) for name in names]


def number(text: Any) -> float | None:
    """A start value as a number, where it is one.

    Args:
        text: as the description gives it.
    """
    try:
        return float(text)
    except (TypeError, ValueError):
        return None


def _unread(variable: ModelVariable) -> str:
    shape = "" if not variable.shape else "[" + ", ".join(map(str, variable.shape)) + "]"
    return f"{variable.causality} {variable.name}{shape}: {variable.type}"
