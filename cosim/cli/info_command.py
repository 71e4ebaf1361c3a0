"""``cosim info WHAT``: what an FMU says about itself and whether it can run here, what is in a system structure
package, or what a model declares.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import fmpy
from fmpy.model_description import ModelVariable

from cosim import ssp
from cosim.cli.arguments import PLAIN_JSON
from cosim.components.description import read_description, runs_here
from cosim.scenario.package_names import is_package
from fmus.cli.commands import argument
from fmus.fmi.capabilities import read_capabilities
from fmus.text_table import text_table
from plant_models.user_file import names_a_file, names_code

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
    PLAIN_JSON,
)


def execute(options: argparse.Namespace) -> int:
    """Print the description.

    Args:
        options: of the command line.
    """
    if is_package(options.what):
        return _execute_package(options)
    data = _described_model(options.what) if _names_a_model(options.what) else describe_file(Path(options.what))
    if options.json:
        print(json.dumps(data, indent=2))
        return 0
    variables = data.pop("variables")
    rows = [[key, ", ".join(map(str, value)) if isinstance(value, list) else str(value)] for key, value in data.items()]
    print("\n".join(text_table(rows, left=(0, 1))))
    for causality in ("input", "output", "parameter", "local"):
        chosen = [v for v in variables if v["causality"] == causality]
        print(f"{causality}s ({len(chosen)}):")
        for v in chosen:
            start = "" if v["start"] is None else f" = {v['start']}"
            kind = " ".join(filter(None, (v["type"], v["variability"])))
            print(f"  {v['name']}{start} [{v['unit'] or '-'}] {kind}  {v['description'] or ''}".rstrip())
    return 0


def _execute_package(options: argparse.Namespace) -> int:
    data = ssp.describe_package(options.what)
    if options.json:
        print(json.dumps(data, indent=2))
    else:
        print(ssp.text_of_package(data))
    return 0


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
    interfaces = {
        "coSimulation": "co-simulation",
        "modelExchange": "model exchange",
        "scheduledExecution": "scheduled execution",
    }
    return {
        "file": str(path),
        "model": description.modelName,
        "description": description.description or "",
        "FMI version": description.fmiVersion,
        "interfaces": [text for name, text in interfaces.items() if getattr(description, name) is not None],
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
