"""The options that state what is known of the variables of an FMU alone, in the same words."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cosim.components.description import read_description
from cosim.components.stated_lines import stated_lines
from cosim.components.stated_units import StatedUnit
from cosim.errors import ScenarioError
from cosim.starter.guessed_signal import UNITS
from fmus.cli.commands import repeated
from fmus.fmi.units import Units

ASSUME = repeated(
    "--assume",
    "NAME=UNIT",
    "what you know of a variable of an FMU: its unit, -UNIT where it counts the other way, its role (position, speed, "
    "wheel_speed, effort, mass, ...), or ROLE,UNIT",
)
UNIT = repeated(
    "--unit",
    "NAME=UNIT",
    "of an FMU: the unit of a variable that it does not declare, -UNIT where it counts the other way",
)


def stated_of(path: str | Path, lines: Sequence[str]) -> dict[str, StatedUnit]:
    """What the option ``--unit`` states of an FMU, by name of the variable.

    Args:
        path: of the file. lines: of the option.

    Raises:
        FmuLoadError: it cannot be read. ScenarioError: a line states nothing, or there is no FMU that it could be of.
    """
    if not lines:
        return {}
    if Path(path).suffix.lower() != ".fmu":
        raise ScenarioError(
            f"--unit belongs to an FMU; {path} is none. In a scenario it stands in the table [components.NAME.units]."
        )
    variables = read_description(str(path), str(path)).modelVariables
    return stated_lines("--unit", lines, {v.name: Units.name(v) for v in variables}, UNITS)
