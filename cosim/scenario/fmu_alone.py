"""An FMU alone as a scenario: its inputs held, or played back from a table. Reads the description, loads nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fmpy.model_description import DefaultExperiment, ModelDescription

from cosim.components.component import Component
from cosim.components.loading import describe_fmu
from cosim.components.recording_data import Chosen
from cosim.errors import ScenarioError, nearest
from cosim.results.load_result import load_result
from cosim.scenario.schema import step_count

STEPS = 1000
"""Communication steps of a run where the FMU does not say how long one should be."""
SOURCE = "inputs"
"""Name of the component that plays back the inputs."""


@dataclass(frozen=True)
class FmuAlone:
    """How an FMU alone is run.

    Args:
        start, stop: of the run [s]; None for those of the FMU's default experiment. step: communication step [s]; None
            for the FMU's own, or a thousandth of the run. inputs: constants by name, or the path of a table.
        parameters: start values by name. record: signals to record besides the outputs.
        interpolation: of the columns of the table, as for a recording. units: what is known of its variables and not
            declared, as in a scenario file.
    """

    start: float | None = None
    stop: float | None = None
    step: float | None = None
    inputs: Mapping[str, Any] | str | Path | None = None
    parameters: Mapping[str, Any] | None = None
    record: Sequence[str] = ()
    interpolation: Chosen = None
    units: Mapping[str, Any] | None = None


def tables_of_fmu(path: Path, name: str, run: FmuAlone) -> tuple[dict[str, Any], list[str]]:
    """The tables of a scenario of one FMU, and what is doubtful about it.

    Args:
        path: of the file. name: of the component. run: how it is run.

    Raises:
        FmuLoadError: the FMU cannot be read.
        ScenarioError: no end is known, or an input does not exist.
    """
    where, inputs = path.name, run.inputs
    component = describe_fmu(path, name)
    begin, end, length = run_times(component.description, run.start, run.stop, run.step, where)
    table: dict[str, Any] = {"fmu": str(path.resolve())}
    tables: dict[str, Any] = {"title": where, "start": begin, "stop": end, "step": length, "components": {name: table}}
    values = dict(run.parameters or {})
    warnings: list[str] = []
    if isinstance(inputs, Mapping):
        _check_inputs(inputs, component, where)
        values |= inputs
    elif inputs is not None:
        source = Path(inputs).resolve()
        courses = {} if run.interpolation is None else {"interpolation": run.interpolation}
        tables["connections"], warnings = _matches(source, component, where)
        tables["components"] = {SOURCE: {"recording": str(source)} | courses, **tables["components"]}
    if values:
        table["parameters"] = values
    if run.record:
        table["record"] = list(run.record)
    if run.units:
        table["units"] = dict(run.units)
    return tables, warnings


def run_times(
    description: ModelDescription, start: float | None, stop: float | None, step: float | None, where: str
) -> tuple[float, float, float]:
    """Start, stop and step [s]: as given, else of the FMU's default experiment; without its step, a thousandth of the
    run.

    Args:
        description: model description of the FMU.
        start: begin of the run [s]; None for that of the FMU's default experiment.
        where: name of the scenario, for messages.

    Raises:
        ScenarioError: there is no stop, or the step does not divide the run.
    """
    advised = description.defaultExperiment or DefaultExperiment()
    begin = _number(advised.startTime) or 0.0 if start is None else start
    end = _number(advised.stopTime) if stop is None else stop
    if end is None:
        raise ScenarioError(f"{where} has no default experiment that says when a run ends; give 'stop' [s].")
    if step is not None:
        return begin, end, step
    length = _number(advised.stepSize)
    try:
        step_count(begin, end, length or 0.0)
    except ValueError:
        length = None
    return begin, end, length or (end - begin) / STEPS


def _number(value: Any) -> float | None:
    return None if value in (None, "") else float(value)


def _check_inputs(inputs: Mapping[str, Any], component: Component, where: str) -> None:
    known = [name for name, variable in component.variables.items() if variable.causality == "input"]
    for name in inputs:
        if name.partition("[")[0] not in {k.partition("[")[0] for k in known}:
            raise ScenarioError(f"{where} has no input {name!r}; {nearest(name, known)}")


def _matches(source: Path, component: Component, where: str) -> tuple[list[str], list[str]]:
    """Connections of the columns that are named as inputs are, and a word about the others.

    Raises:
        ScenarioError: no column is.
    """
    columns = [signal.name for signal in load_result(source, texts=True).signals]
    inputs = set(component.names("input"))
    used = [name for name in columns if name in inputs]
    unused = [name for name in columns if name not in inputs]
    if not used:
        raise ScenarioError(
            f"{source.name}: no column is named as an input of {where}. Columns: {', '.join(columns) or 'none'}; "
            f"inputs: {', '.join(sorted(inputs)) or 'none'}."
        )
    warnings = (
        [f"{source.name}: columns that are no inputs of {where} are not used: {', '.join(unused)}."] if unused else []
    )
    return [f"{SOURCE}.{name} -> {component.name}.{name}" for name in used], warnings
