"""What to warn of where a component does not have the values that a scenario sets: parameters, inputs, start states."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from fmpy.model_description import ModelVariable

from cosim.components.component import Component
from cosim.components.start_values import declared_start
from cosim.diagnostics.messages import MessageLog
from cosim.process.last_call import LAST_CALL
from cosim.run.coupled import Coupled
from fmus.fmi.instance import NAMES_SHOWN
from fmus.fmi.read_back import NotTaken, not_taken
from fmus.fmi.types import is_continuous

_OF_ENVIRONMENT = frozenset({"parameter", "structuralParameter", "input"})
"""Causalities of what only the environment of a component changes."""


def values_not_taken(coupled: Coupled, *, stepped: bool = False) -> Iterator[str]:
    """A warning for each FMU that was set values and has others.

    Args:
        coupled: initialised. stepped: since then, so that states have moved on; some FMUs forget in steps what they
            were set.
    """
    connected = {connection.target for connection in coupled.routed}
    for name, component in coupled.components.items():
        if component.kind != "FMU" or not component.usable:
            continue
        stated = [n for n in component.starts if not connected & {(name, n), (name, component.variables[n].name)}]
        found = list(_found(component, stated, stepped))
        if found:
            more = f", and {len(found) - NAMES_SHOWN} more" if len(found) > NAMES_SHOWN else ""
            yield f"{name} does not take what it is set: {', '.join(map(str, found[:NAMES_SHOWN]))}{more}."


def _found(component: Component, names: Iterable[str], stepped: bool) -> Iterator[NotTaken]:
    """Of a start state only one that has the value of the model description: an event may have changed it at once."""
    own, component.messages = component.messages, MessageLog(component.name)  # a refusal to be read is no fault
    try:
        with LAST_CALL.making(component.name, "reading back its start values", component.time):
            for found in not_taken(component, {name: component.starts[name] for name in names}):
                variable = component.variables[found.name]
                if variable.causality in _OF_ENVIRONMENT or (not stepped and _ignored(variable, found.has)):
                    yield found
    finally:
        component.messages = own


def _ignored(variable: ModelVariable, has: Any) -> bool:
    return variable.initial == "exact" and is_continuous(variable) and declared_start(variable) == has
