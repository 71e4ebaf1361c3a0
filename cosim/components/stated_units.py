"""Facts about an FMU that only its owner knows: units, signs, offsets and meanings that the scenario states. They are
taken as if the FMU had declared them. Knows descriptions only.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated, Any, Literal

from fmpy.model_description import BaseUnit, ModelDescription, ModelVariable
from fmpy.model_description import Unit as DeclaredUnit
from pydantic import BeforeValidator, Field, TypeAdapter, ValidationError

from cosim.errors import CouplingError, nearest
from cosim.toml_table import TomlTable
from fmus.fmi.types import NUMERIC_TYPES
from fmus.fmi.units import NamedUnit, Units
from plant_models.hybrid.units import BASE_SYMBOLS, Unit, UnitError

_WITHOUT_UNIT = ("Boolean", "Enumeration")


class StatedUnit(TomlTable):
    """What is known of a variable: ``value as usual = sign * value of the FMU + offset``, in the unit."""

    unit: str | None = Field(default=None, description="its unit; the declared one by default")
    sign: Literal[1, -1] = Field(default=1, description="-1 where the FMU counts in the other direction")
    offset: float = Field(default=0.0, description="added behind the sign, in the unit")
    meaning: str | None = Field(default=None, description="what it is, for people; the FMU's description by default")
    instead_of: str | None = Field(default=None, description="the declared unit, where it is wrong")


Stated = Annotated[StatedUnit, BeforeValidator(lambda stated: {"unit": stated} if isinstance(stated, str) else stated)]
"""A unit, or a table of what else is known."""


def stated_units(units: Mapping[str, Any]) -> dict[str, StatedUnit]:
    """What is stated in plain data, as of a scenario file or of the recipe of a baseline.

    Args:
        units: by name of the variable a unit, or a table of what else is known.

    Raises:
        CouplingError: it is none of these.
    """
    try:
        return TypeAdapter(dict[str, Stated]).validate_python(dict(units))
    except ValidationError as error:
        raise CouplingError(f"units: {error.errors()[0]['loc'][0]}: {error.errors()[0]['msg']}.") from error


NONE_STATED: Mapping[str, StatedUnit] = MappingProxyType({})


def state_units(description: ModelDescription, stated: Mapping[str, StatedUnit], name: str) -> None:
    """Have a description declare what the scenario states.

    Args:
        description: of an FMU, that nobody else has; it is changed. stated: by name of the variable.
        name: of the component, for messages.

    Raises:
        CouplingError: there is no such variable, it has no unit, the unit is unknown, or another one is declared.
    """
    variables = {variable.name: variable for variable in description.modelVariables} if stated else {}
    for key, fact in stated.items():
        place = f"components.{name}.units: {key}"
        if key not in variables:
            raise CouplingError(f"{place}: {name} has no variable {key!r}; {nearest(key, variables)}")
        _state(description, variables[key], fact, place)


def _state(description: ModelDescription, variable: ModelVariable, fact: StatedUnit, place: str) -> None:
    if fact.meaning is not None:
        variable.description = fact.meaning
    if fact.unit is None and fact.sign == 1 and fact.offset == 0.0:
        return
    if variable.type not in NUMERIC_TYPES or variable.type in _WITHOUT_UNIT:
        raise CouplingError(f"{place}: it is of type {variable.type}, which has no unit.")
    units, declared = Units(description), Units.name(variable)
    named = fact.unit or declared
    if named is None:
        raise CouplingError(f"{place}: a sign and an offset need a unit; the FMU declares none, so state 'unit'.")
    try:
        unit = units.meaning(named)
    except UnitError as error:
        raise CouplingError(f"{place}: {error}.") from error
    if declared not in (None, named, fact.instead_of):
        _demand_same(place, NamedUnit(named, unit), units.named(variable) or NamedUnit(named, unit))
    variable.displayUnit = variable.displayUnit if fact.unit is None and variable.displayUnit else named
    variable.unit = _defined(description, named, unit, fact)


def _demand_same(place: str, stated: NamedUnit, declared: NamedUnit) -> None:
    """Refuse a unit that contradicts the declared one."""
    if stated.unit == declared.unit:
        return
    other = "" if stated.fits(declared) else ", which is of another kind"
    raise CouplingError(
        f"{place}: {stated.name} is stated, and the FMU declares {declared.name}{other}. Take the line away, or write "
        f'{{ unit = "{stated.name}", instead_of = "{declared.name}" }} where the FMU is wrong.'
    )


def _defined(description: ModelDescription, named: str, unit: Unit, fact: StatedUnit) -> str:
    """The name under which the description defines the unit, with the sign and the offset in it."""
    name = f"{'-' if fact.sign < 0 else ''}{named}" + (f"{fact.offset:+g}" if fact.offset else "")
    factor, offset = unit.factor * fact.sign, unit.factor * fact.offset + unit.offset
    if name != named and all(known.name != name for known in description.unitDefinitions):
        base = BaseUnit(**dict(zip(BASE_SYMBOLS, unit.exponents, strict=True)), factor=factor, offset=offset)
        description.unitDefinitions.append(DeclaredUnit(name=name, baseUnit=base))
    return name
