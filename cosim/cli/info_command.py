"""``cosim info WHAT``: what an FMU says about itself and whether it can run here, what is in a system structure
package, or what a model declares.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cosim import ssp
from cosim.cli.stated_units import UNIT, stated_of
from cosim.components.description import read_description, runs_here
from cosim.components.stated_units import StatedUnit, state_units
from cosim.errors import ScenarioError
from cosim.scenario.package_names import is_package
from fmus.cli.commands import argument
from fmus.cli.output import Output
from fmus.fmi.capabilities import read_capabilities
from fmus.fmu_report import describe_file, description_parts
from plant_models.user_file import names_a_file, names_code

GROUP = "Models and files"
PLACE = 2
HELP = "describe an FMU, an SSP file, a plant or an observer"
LOOKS = True
EXAMPLES = (
    "cosim info vendor.fmu",
    "cosim info quasi_lpv_uio",
)
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
    UNIT,
)


def execute(options: argparse.Namespace) -> Output:
    """The description of what the options name.

    Raises:
        CosimError: there is no such file or model, or stated units do not fit it.
    """
    stated = stated_of(options.what, options.unit)
    if is_package(options.what):
        package = ssp.describe_package(options.what)
        return Output([ssp.text_of_package(package)], package)
    data = (
        _described_model(options.what) if _names_a_model(options.what) else _described_file(Path(options.what), stated)
    )
    return Output(description_parts(data), data)


def _described_file(path: Path, stated: Mapping[str, StatedUnit]) -> dict[str, Any]:
    if path.suffix.lower() == ".toml":
        raise ScenarioError(f"{path} is a scenario; 'cosim show {path}' shows what is in it.")
    description = read_description(path, path.name)  # which says what is wrong with a file
    state_units(description, stated, path.stem)
    declared = list(read_capabilities(description).declared())
    return {"runs here": runs_here(path), "declares": declared} | describe_file(path, description)


def _described_model(name: str) -> dict[str, Any]:
    from cosim.cli.model_info import describe_model  # noqa: PLC0415 - models and the schema, not for files

    return describe_model(name)


def _names_a_model(text: str) -> bool:
    """Whether what was typed is meant as the name of a model, and not as that of an FMU or SSP file."""
    path = Path(text)
    if names_a_file(text) or path.suffix.lower() in (".fmu", ".ssp"):
        return names_a_file(text)
    return not path.exists() and (names_code(text) or not path.suffix)
