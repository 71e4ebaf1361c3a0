"""What a user knows of the variables of an FMU on the command line, ``vIst=speed,-km/h``, as a scenario states it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from cosim.components.stated_units import StatedUnit
from cosim.errors import ScenarioError

_EXPECTED = "expected NAME=UNIT, NAME=-UNIT where it counts the other way, NAME=ROLE, or ROLE and UNIT with a comma"


def stated_lines(
    option: str, lines: Sequence[str], declared: Mapping[str, str | None], roles: Collection[str]
) -> dict[str, StatedUnit]:
    """What is stated, by name of the variable; a declared unit is replaced by one that is stated.

    Args:
        option: of the command line, for messages. lines: as ``vIst=km/h`` each. declared: names of the units that the
            FMU declares, by variable. roles: words that say what a variable is.

    Raises:
        ScenarioError: a line is not of this form.
    """
    found: dict[str, StatedUnit] = {}
    for line in lines:
        name, equals, text = (part.strip() for part in line.rpartition("="))
        words = [word.strip() for word in text.split(",")]
        meant, units = [w for w in words if w in roles], [w for w in words if w not in roles]
        if not equals or not name or "" in words or len(meant) > 1 or len(units) > 1:
            raise ScenarioError(f"{option} {line!r}: {_EXPECTED}; the roles are {', '.join(roles)}.")
        found[name] = _stated(meant, units, declared.get(name))
    return found


def _stated(roles: Sequence[str], units: Sequence[str], declared: str | None) -> StatedUnit:
    known: dict[str, object] = {"meaning": roles[0]} if roles else {}
    for unit in units:
        plain = unit.removeprefix("-")
        known |= {"unit": plain} if plain else {}
        known |= {"sign": -1} if plain != unit else {}
        known |= {"instead_of": declared} if plain and declared not in (None, plain) else {}
    return StatedUnit.model_validate(known)
