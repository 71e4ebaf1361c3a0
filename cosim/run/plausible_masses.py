"""Masses that cannot be those of a train, as 90 kg where 90 t is meant: named before the run, with the likely cause."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from cosim.components.component import Component
from cosim.components.start_values import declared_start
from cosim.scenario.scenario_tables import ComponentTable
from plant_models.hybrid.units import Unit, UnitError, parse_unit

LIGHTEST = 1000.0
"""No rail vehicle that carries a driver weighs less [kg]."""
HEAVIEST = 1e8
"""No train weighs more [kg]; the heaviest that ever ran had as many tonnes."""
APART = 200.0
"""From this ratio on, two masses are not those of one train: a trailing load is less, a thousand is a wrong unit."""
_MASS, _FORCE = parse_unit("kg"), parse_unit("N")
_WHOLE = "mass"
"""Name of the parameter by which models of trains, which are driven by a force, know their mass."""
_PER_UNIT_MASS = 1.0
"""Mass [kg] with which models whose forces are per unit mass are computed."""


@dataclass(frozen=True)
class _Mass:
    """A mass in use.

    Args:
        name: ``component.parameter``. value: in use [kg]. declared: by the component [kg], None where nothing is.
        stated: whether the scenario sets it. of_train: whether it is that of a whole train or what an observer
            takes for it.
    """

    name: str
    value: float
    declared: float | None
    stated: bool
    of_train: bool


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
        f"{mass.name} is {mass.value:g} kg{how}, beside {other.name} = {other.value:g} kg; where both are of one train "
        f"write {parameter} = {other.value:g} in [components.{component}.parameters]."
    )


def _alone(mass: _Mass) -> str:
    """What is doubtful about a mass that the scenario states, or an empty text."""
    train = mass.of_train or (mass.declared or 0.0) >= LIGHTEST
    if not mass.stated or not train or mass.value == _PER_UNIT_MASS:
        return ""
    light = 0.0 < mass.value < LIGHTEST
    if light and mass.declared is not None and mass.declared >= LIGHTEST:
        light = mass.value * APART <= mass.declared
    if light:
        return (
            f"{mass.name} = {mass.value:g} kg is no mass of a train; it is stated in kilograms: for {mass.value:g} t "
            f"write {1e3 * mass.value:g}."
        )
    if mass.value > HEAVIEST:
        return f"{mass.name} = {mass.value:g} kg is no mass of a train; it is stated in kilograms, not in grams."
    return ""


def _masses(component: Component, parameters: Mapping[str, Any]) -> Iterator[_Mass]:
    """The scalar masses of a component that have a value: those that are stated, and its own as a train."""
    named = [name for name in dict.fromkeys([*parameters, _WHOLE]) if name in component.variables]
    for name in (n for n in named if _has_unit(component, n, _MASS)):
        unit, declared = component.unit(name), declared_start(component.variables[name])
        value = parameters.get(name, declared)
        if unit is not None and isinstance(value, int | float) and not isinstance(value, bool):
            known = declared * unit.factor if isinstance(declared, int | float) else None
            driven = name == _WHOLE and any(_has_unit(component, i, _FORCE) for i in component.names("input"))
            yield _Mass(f"{component.name}.{name}", value * unit.factor, known, name in parameters, driven)


def _has_unit(component: Component, name: str, meant: Unit) -> bool:
    """Whether a variable has a unit that can be converted to another; one that cannot be understood cannot."""
    try:
        unit = component.unit(name)
    except UnitError:
        return False
    return unit is not None and unit.exponents == meant.exponents
