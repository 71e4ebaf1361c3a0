"""``cosim info WHAT``: what an FMU says about itself and whether it can run here, what is in a system structure
package, or what a model declares.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import fmpy
from fmpy.model_description import ModelVariable

from cosim import ssp
from cosim.components.description import read_description, runs_here
from cosim.scenario.package_names import is_package
from fmus.cli.commands import argument
from fmus.cli.output import Output
from fmus.fmi.capabilities import read_capabilities
from fmus.fmi.standard import INTERFACES
from fmus.tables.table import Table, name_column, pairs_table, text_column
from plant_models.user_file import names_a_file, names_code

_VARIABLE_COLUMNS = (
    name_column("name"),
    text_column("start", write=lambda value: "" if value is None else f"= {value}"),
    *(text_column(key) for key in ("unit", "type", "description")),
)
GROUP = "Models and files"
HELP = "describe an FMU, an SSP file, a plant or an observer"
PARSER = {
    "description": (
        "Interfaces, platforms and variables of an FMU; the systems, components and connections in an SSP; or what"
        " a plant or an observer declares."
    )
}
ARGUMENTS = (
    argument(
        "what",
        metavar="WHAT",
        help="an .fmu or .ssp file, a name of 'cosim list', file.py:Class or package.module:Class",
    ),
)


def execute(options: argparse.Namespace) -> Output:
    """The description."""
    if is_package(options.what):
        package = ssp.describe_package(options.what)
        return Output([ssp.text_of_package(package)], package)
    data = _described_model(options.what) if _names_a_model(options.what) else describe_file(Path(options.what))
    properties = {key: value for key, value in data.items() if key != "variables"}
    tables = [_variables(data["variables"], causality) for causality in ("input", "output", "parameter", "local")]
    return Output([pairs_table("properties", properties), *tables], data)


def _variables(variables: Sequence[Mapping[str, Any]], causality: str) -> Table | str:
    """The variables of a causality."""
    rows = [
        [
            *(v["name"], v["start"], f"[{v['unit'] or '-'}]"),
            *(" ".join(filter(None, (v["type"], v["variability"]))), v["description"] or ""),
        ]
        for v in variables
        if v["causality"] == causality
    ]
    title = f"{causality}s ({len(rows)}):"
    return Table("variables", _VARIABLE_COLUMNS, rows, title) if rows else title


def _described_model(name: str) -> dict[str, Any]:
    from cosim.cli.model_info import describe_model  # noqa: PLC0415 - models and the schema, not for files

    return describe_model(name)


def _names_a_model(text: str) -> bool:
    """Whether what was typed is meant as the name of a model, and not as that of an FMU or SSP file."""
    path = Path(text)
    if names_a_file(text) or path.suffix.lower() in (".fmu", ".ssp"):
        return names_a_file(text)
    return not path.exists() and (names_code(text) or not path.suffix)


def describe_file(path: Path) -> dict[str, Any]:
    """The description of an FMU file as plain data.

    Args:
        path: of the file.

    Raises:
        FmuLoadError: the file is missing or not an FMU.
    """
    description = read_description(path, "info")
    return {
        "file": str(path),
        "model": description.modelName,
        "description": description.description or "",
        "FMI version": description.fmiVersion,
        "interfaces": [text for name, text in INTERFACES.items() if getattr(description, name) is not None],
        "platforms": list(fmpy.supported_platforms(str(path))),
        "runs here": runs_here(path),
        "tool": description.generationTool or "",
        "declares": list(read_capabilities(description).declared()),
        "variables": [_variable(v) for v in description.modelVariables],
    }


def _variable(variable: ModelVariable) -> dict[str, Any]:
    keys = ("variability", "type", "unit", "start", "description")
    known = {key: getattr(variable, key) for key in keys}
    return {"name": variable.name, "causality": variable.causality or "local"} | known
