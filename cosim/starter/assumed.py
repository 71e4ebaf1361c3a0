"""What a user assumes of an FMU on the command line, ``vIst=speed,-km/h``, as a scenario states it."""

from __future__ import annotations

from collections.abc import Sequence

from cosim.components.stated_units import StatedUnit
from cosim.errors import ScenarioError
from cosim.starter.guessed_signal import UNITS
from cosim.starter.inspected_fmu import InspectedFmu
from cosim.starter.probed_facts import Fact

_EXPECTED = "expected NAME=UNIT, NAME=-UNIT where it counts the other way, NAME=ROLE, or ROLE and UNIT with a comma"


def assumed_facts(lines: Sequence[str], inspected: InspectedFmu) -> dict[str, Fact]:
    """Facts by name of the variable; a declared unit is replaced by one that is assumed.

    Args:
        lines: as ``vIst=km/h`` each. inspected: what the FMU says without them.

    Raises:
        ScenarioError: a line is not of this form.
    """
    declared = {v.name: inspected.component.unit_name(v.name) for v in inspected.component.variables.values()}
    facts: dict[str, Fact] = {}
    for line in lines:
        name, equals, text = (part.strip() for part in line.rpartition("="))
        words = [word.strip() for word in text.split(",")]
        roles, units = [w for w in words if w in UNITS], [w for w in words if w not in UNITS]
        if not equals or not name or "" in words or len(roles) > 1 or len(units) > 1:
            raise ScenarioError(f"--assume {line!r}: {_EXPECTED}; the roles are {', '.join(UNITS)}.")
        facts[name] = Fact(_stated(roles, units, declared.get(name)), "as assumed")
    return facts


def _stated(roles: Sequence[str], units: Sequence[str], declared: str | None) -> StatedUnit:
    known: dict[str, object] = {"meaning": roles[0]} if roles else {}
    for unit in units:
        plain = unit.removeprefix("-")
        known |= {"unit": plain} if plain else {}
        known |= {"sign": -1} if plain != unit else {}
        known |= {"instead_of": declared} if plain and declared not in (None, plain) else {}
    return StatedUnit.model_validate(known)
