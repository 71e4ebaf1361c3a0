"""Masses that cannot be those of a train, as 90 kg where 90 t is meant: named before the run, with the likely cause."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import sqrt
from typing import Any

from cosim.components.component import Component
from cosim.components.start_values import declared_start
from cosim.scenario.scenario_tables import ComponentTable
from fmus.fmi.units import Units
from plant_models.hybrid.units import Unit, UnitError, parse_unit

LIGHTEST = 1000.0
"""No rail vehicle that carries a driver weighs less [kg]."""
HEAVIEST = 1e8
"""No train weighs more [kg]; the heaviest that ever ran had as many tonnes."""
APART = 200.0
"""From this ratio on, two masses are not those of one train: a trailing load is less, a thousand is a wrong unit."""
_TOO_HEAVY = 500.0
"""From this ratio to what a component declares on, a mass is in a unit that is a thousand times less."""
_THOUSAND = 1000.0
_MASS, _FORCE = parse_unit("kg"), parse_unit("N")
_WHOLE = "mass"
"""Name of the parameter by which models of trains, which are driven by a force, know their mass."""
PER_UNIT_MASS = 1.0
"""Mass [kg] with which models whose forces are per unit mass are computed."""


@dataclass(frozen=True)
class _Mass:
    """A mass in use.

    Args:
        name: ``component.parameter``. value: in use [kg]. declared: by the component [kg], None where nothing is.
        unit: in which it is stated, a name. factor: kilograms in it.
        stated: whether the scenario sets it. of_train: whether it is that of a whole train or what an observer
            takes for it.
    """

    name: str
    value: float
    declared: float | None
    unit: str
    factor: float
    stated: bool
    of_train: bool

    @property
    def text(self) -> str:
        """As it is stated, with its unit."""
        return f"{self.value / self.factor:g} {self.unit}"


def mass_warnings(tables: Mapping[str, ComponentTable], components: Mapping[str, Component]) -> list[str]:
    """Masses that are hardly meant.

    Args:
        tables: of the components, by name. components: by name.

    Returns:
        A text for each, with the likely error.
    """
    found = [mass for name, table in tables.items() for mass in _masses(components[name], table.parameters)]
    alone = {mass.name: text for mass in found if (text := _alone(mass))}
    trains = [mass for mass in found if mass.of_train and mass.name not in alone]
    heaviest = max(trains, key=lambda mass: mass.value, default=None)
    if heaviest is None or heaviest.value < LIGHTEST:
        return list(alone.values())
    return [*alone.values(), *(_beside(m, heaviest) for m in trains if m.value * APART <= heaviest.value)]


def _beside(mass: _Mass, other: _Mass) -> str:
    """What is doubtful about two masses of one train."""
    component, _, parameter = mass.name.partition(".")
    how = "" if mass.stated else ", its default"
    return (
        f"{mass.name} is {mass.text}{how}, beside {other.name} = {other.text}; where both are of one train "
        f"write {parameter} = {other.value / mass.factor:g} in [components.{component}.parameters]."
    )


def _alone(mass: _Mass) -> str:
    """What is doubtful about one mass, or an empty text."""
    train = mass.of_train or (mass.stated and (mass.declared or 0.0) >= LIGHTEST)
    if not train or mass.value == PER_UNIT_MASS:
        return ""
    how = f"= {mass.text}" if mass.stated else f"is {mass.text}, its default, which"
    if _is_light(mass):
        number, meant = mass.value / mass.factor, ("t", 1e3) if mass.factor < _THOUSAND else ("1000 t", 1e6)
        return (
            f"{mass.name} {how} is no mass of a train; it is stated in {_unit_text(mass)}: for {number:g} {meant[0]} "
            f"write {number * meant[1] / mass.factor:g}."
        )
    if _is_heavy(mass):
        smaller = "kilograms" if mass.factor >= _THOUSAND else "grams"
        return f"{mass.name} {how} is no mass of a train; it is stated in {_unit_text(mass)}, not in {smaller}."
    return ""


def _unit_text(mass: _Mass) -> str:
    return {"kg": "kilograms", "t": "tonnes"}.get(mass.unit, mass.unit)


def _is_light(mass: _Mass) -> bool:
    """Whether it is lighter than a rail vehicle, and nearer to what is declared once it is taken a thousand times."""
    if not 0.0 < mass.value < LIGHTEST:
        return False
    declared = mass.declared or 0.0
    return not mass.stated or declared < LIGHTEST or mass.value * sqrt(_THOUSAND) < declared


def _is_heavy(mass: _Mass) -> bool:
    """Whether it is heavier than a train, or a thousand times as heavy as what is declared."""
    declared = mass.declared or 0.0
    return mass.value > HEAVIEST or (declared >= LIGHTEST and mass.value >= _TOO_HEAVY * declared)


def _masses(component: Component, parameters: Mapping[str, Any]) -> Iterator[_Mass]:
    """The scalar masses of a component that have a value: those that are stated, and its own as a train."""
    named = [name for name in dict.fromkeys([*parameters, _WHOLE]) if name in component.variables]
    for name in (n for n in named if _has_unit(component, n, _MASS)):
        unit, declared = component.unit(name), declared_start(component.variables[name])
        value = parameters.get(name, declared)
        if unit is not None and isinstance(value, int | float) and not isinstance(value, bool):
            known = declared * unit.factor if isinstance(declared, int | float) else None
            driven = name == _WHOLE and any(_has_unit(component, i, _FORCE) for i in component.names("input"))
            stated, named_unit = name in parameters, Units.name(component.variables[name]) or "kg"
            yield _Mass(f"{component.name}.{name}", value * unit.factor, known, named_unit, unit.factor, stated, driven)


def _has_unit(component: Component, name: str, meant: Unit) -> bool:
    """Whether a variable has a unit that can be converted to another; one that cannot be understood cannot."""
    try:
        unit = component.unit(name)
    except UnitError:
        return False
    return unit is not None and unit.exponents == meant.exponents
