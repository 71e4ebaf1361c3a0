"""The starter of an FMU without signals of a train: the FMU alone, its inputs at their start values, to be tested."""

from __future__ import annotations

from math import isfinite
from typing import Any

from fmpy.model_description import DefaultExperiment, ModelVariable

from cosim.errors import CosimError
from cosim.scenario.schema import step_count
from cosim.scenario.starts import start_values
from cosim.starter.look import NAME, Look, number
from cosim.starter.toml_lines import LISTED, comment, entry, one_line
from fmus.fmi.types import FLOATING_TYPES, NUMERIC_TYPES

STOP, STEP, STEPS = 10.0, 0.01, 1000


def alone(look: Look, fmu: str, target: str) -> list[str]:
    """The lines of the scenario.

    Args:
        look: what the FMU says. fmu: its path in the file. target: name of the scenario file.
    """
    stop, step, source = times(look)
    inputs = [v for v in look.component.variables.values() if v.causality == "input"]
    hidden = look.component.event_references()
    lines = [
        entry("title", f"{one_line(look.path.name)} alone"),
        f"{entry('stop', stop)}  # [s] {source}",
        f"{entry('step', step)}  # [s]",
        "",
        f"[components.{NAME}]",
        entry("fmu", fmu),
        "",
    ]
    if inputs:
        lines += comment(
            "Inputs at their start values. Change them here, or play back a table with a column for each (below)."
        )
        lines.append(f"[components.{NAME}.parameters]")
        lines += [_input(look, v) for v in inputs[:LISTED] if v.valueReference not in hidden]
        names = [v.name for v in inputs if v.type in NUMERIC_TYPES and v.valueReference not in hidden]
        lines += ["", *_playback(names)]
    return [*lines, *_hints(look, target)]


def times(look: Look) -> tuple[float, float, str]:
    """Stop and step [s], and where they come from."""
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
    value = _start(variable)
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


def _start(variable: ModelVariable) -> Any:
    if variable.shape or variable.start is None or variable.type in ("Clock", "Binary"):
        return None
    if variable.type == "String":
        return str(variable.start)
    if variable.type == "Boolean":
        return str(variable.start).strip().lower() in ("true", "1")
    if str(variable.type) not in FLOATING_TYPES:
        return int(variable.start) if str(variable.start).strip().lstrip("+-").isdecimal() else None
    value = number(variable.start)
    return value if value is not None and isfinite(value) else None


def _playback(names: list[str]) -> list[str]:
    columns = ", ".join(["time", *(one_line(n) for n in names[:6]), *(["..."] if len(names) > 6 else [])])
    return [
        *comment(f"To play back inputs, write inputs.csv (columns: {columns}), then:"),
        "#",
        "# [components.inputs]",
        '# recording = "inputs.csv"',
        "#",
        f'# and at the top: connections = ["inputs.{one_line(names[0]) if names else "NAME"} -> {NAME}.'
        f'{one_line(names[0]) if names else "NAME"}"]',
        "",
    ]


def _hints(look: Look, target: str) -> list[str]:
    outputs = [s.name for s in look.outputs]
    lines = comment(
        "Nothing here looks like the position or speed of a train, so no observer and no balises are set up."
    )
    lines += ["#", "# For a regression test, put this into test_fmu.py beside this file and run pytest:", "#"]
    lines += ["#     def test_outputs(fmu_regression):", f"#         fmu_regression({target!r})", "#"]
    if outputs:
        lines += comment("Or let the run judge itself; cosim run then ends with 1 where this does not hold:")
        lines += [
            "#",
            "# [[expect]]",
            '# check = "signal"',
            f'# signal = "{NAME}.{one_line(outputs[0])}"',
            "# max = 1.0",
        ]
    return lines
