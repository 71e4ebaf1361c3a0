"""Report: what an FMU file says about itself, in lines of text. Works with any FMU, ours or a vendor's; reads, never runs."""

from __future__ import annotations

import zipfile
from collections.abc import Iterable
from pathlib import Path

from fmpy import read_model_description
from fmpy.model_description import ModelDescription, ModelVariable
from fmpy.validation import validate_fmu

_INTERFACES = (
    ("coSimulation", "co-simulation"),
    ("modelExchange", "model exchange"),
    ("scheduledExecution", "scheduled execution"),
)
_CAPABILITIES = (
    "canHandleVariableCommunicationStepSize",
    "canGetAndSetFMUstate",
    "canSerializeFMUstate",
    "hasEventMode",
    "providesDirectionalDerivative",
)
_SHOWN = ("input", "output", "parameter")


def describe_file(path: Path) -> list[str]:
    """Lines that say what an FMU is: version, interfaces, capabilities, platforms, variables.

    Args:
        path: an FMU file.

    Raises:
        ValueError: the file is not an FMU.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            platforms = sorted(
                {name.split("/")[1] for name in archive.namelist() if name.startswith("binaries/") and name.count("/") > 1}
            )
        description = read_model_description(str(path), validate=False)
    except Exception as error:
        raise ValueError(f"{path} cannot be read as an FMU: {error}") from error
    lines = [
        f"{description.modelName}: FMI {description.fmiVersion}, {', '.join(_interfaces(description)) or 'no interface'}",
        *([description.description] if description.description else []),
        f"platforms: {', '.join(platforms) or 'none'}",
        f"capabilities: {', '.join(_capabilities(description)) or 'none'}",
    ]
    for causality in _SHOWN:
        chosen = [v for v in description.modelVariables if v.causality == causality]
        if chosen:
            lines += [f"{causality}s:", *_variables(chosen)]
    return lines


def problems_of(path: Path) -> list[str]:
    """Problems that fmpy's validation finds in an FMU; empty for a valid one."""
    problems: list[str] = validate_fmu(str(path))
    return problems


def _interfaces(description: ModelDescription) -> list[str]:
    return [text for name, text in _INTERFACES if getattr(description, name) is not None]


def _capabilities(description: ModelDescription) -> list[str]:
    cosimulation = description.coSimulation
    return [] if cosimulation is None else [name for name in _CAPABILITIES if getattr(cosimulation, name)]


def _variables(variables: Iterable[ModelVariable]) -> list[str]:
    return [f"  {_value(v)}  {v.description or ''}".rstrip() for v in variables]


def _value(variable: ModelVariable) -> str:
    start = "" if variable.start is None else f" = {variable.start}"
    return f"{variable.name}{start} [{variable.unit or ('clock' if variable.type == 'Clock' else '1')}]"
