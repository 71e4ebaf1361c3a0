"""The starter of an FMU without signals of a train: the FMU alone, its inputs at their start values, to be tested."""

from __future__ import annotations

from typing import Any

from fmpy.model_description import DefaultExperiment, ModelVariable

from cosim.components.start_values import declared_start, start_values
from cosim.errors import CosimError
from cosim.scenario.schema import step_count
from cosim.starter.look import Look, number
from cosim.starter.toml_lines import LISTED, entry, one_line
from fmus.fmi.types import NUMERIC_TYPES

STOP, STEP, STEPS = 10.0, 0.01, 1000
_COLUMNS_NAMED = 6


def alone(look: Look) -> dict[str, Any]:
    """What the template of this starter inserts.

    Args:
        look: what the FMU says.

    Returns:
        Values by name.
    """
    stop, step, source = times(look)
    inputs = [v for v in look.component.variables.values() if v.causality == "input"]
    hidden = look.component.event_references()
    names = [v.name for v in inputs if v.type in NUMERIC_TYPES and v.valueReference not in hidden]
    return {
        "title": f"{one_line(look.path.name)} alone",
        "stop": stop,
        "step": step,
        "source": source,
        "has_inputs": bool(inputs),
        "inputs": [_input(look, v) for v in inputs[:LISTED] if v.valueReference not in hidden],
        "columns": ["time", *map(one_line, names[:_COLUMNS_NAMED]), *(["..."] if len(names) > _COLUMNS_NAMED else [])],
        "first": names[0] if names else "NAME",
    }


def times(look: Look) -> tuple[float, float, str]:
    """When the run stops and how long its steps are.

    Args:
        look: what the FMU says.

    Returns:
        Stop and step [s], and where they come from.
    """
    advised = look.description.defaultExperiment or DefaultExperiment()
    stop, length = number(advised.stopTime), number(advised.stepSize)
    start = number(advised.startTime) or 0.0
    if stop is None or start != 0.0 or stop <= 0.0:
        return STOP, STEP, "the FMU names no end of a run; write your own"
    try:
        step_count(0.0, stop, length or 0.0)
    except ValueError:
        length = None
    return stop, length or stop / STEPS, "from the FMU's default experiment"


def _input(look: Look, variable: ModelVariable) -> str:
    """An input's start value, as a comment where it has none or the master would not take it."""
    unit, said = look.component.unit_name(variable.name) or "-", one_line(variable.description or "")
    remark = f"  # [{one_line(unit)}] {said}".rstrip()
    value = declared_start(variable)
    if value is None:
        kind = f"{variable.type} array" if variable.shape else str(variable.type)
        return f"# {entry(variable.name, 0.0).rpartition(' = ')[0]} = ...{remark} ({kind})"
    try:
        start_values(look.component, {variable.name: value})
    except CosimError as error:
        return (
            f"# {entry(variable.name, value)}{remark} - its own start value does not fit it: "
            f"{one_line(str(error), 200)}"
        )
    return entry(variable.name, value) + remark
