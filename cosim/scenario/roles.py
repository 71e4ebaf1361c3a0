"""Roles: the signals a report is told to use exist, and are what they are said to be."""

from __future__ import annotations

from collections.abc import Mapping

from cosim.components.component import Component
from cosim.coupling.connection import split_name
from cosim.errors import ScenarioError, nearest
from cosim.scenario.schema import ScenarioTable
from plant_models.hybrid.units import UnitError, conversion, parse_unit

ROLES = {
    "true_position": "m",
    "true_speed": "m/s",
    "true_slip": "1",
    "true_adhesion_force": "N",
    "odometer": "m/s",
    "speed_reference": "m/s",
}


def signals_to_record(table: ScenarioTable) -> dict[str, list[str]]:
    """What is recorded besides the outputs, by component: what its table, balises, report and expectations name."""
    record = {name: list(component.record) for name, component in table.components.items()}
    used = [getattr(table.report, role) for role in ROLES]
    used += [] if table.balises is None else [table.balises.position, table.balises.speed, table.balises.odometer]
    used += [getattr(item, key, None) for item in table.expect for key in ("signal", "reference")]
    for name in filter(None, used):
        component, _, signal = name.partition(".")
        if component in record and signal not in record[component]:
            record[component].append(signal)
    return record


def check_roles(table: ScenarioTable, components: Mapping[str, Component], where: str) -> None:
    """Check the report table of a scenario against its components.

    Raises:
        ScenarioError: an observer that is no component, a signal of another dimension, a phase or zone without length.
        CouplingError: a signal that does not exist; the nearest names are suggested.
    """
    report = table.report
    for role, unit in ROLES.items():
        name = getattr(report, role)
        if name is not None:
            _check_signal(name, unit, components, f"{where}: report.{role}")
    for name in report.observers or []:
        if name not in components:
            raise ScenarioError(f"{where}: report.observers: no component {name!r}; {nearest(name, components)}")
    intervals = [(f"report.phases, {p.name!r}", p.start, p.end) for p in report.phases]
    intervals += [(f"report.zones, number {i}", *zone) for i, zone in enumerate(report.zones, start=1)]
    for what, start, end in intervals:
        if not start < end:
            raise ScenarioError(f"{where}: {what}: ends at {end:g} s, before or when it begins at {start:g} s.")


def _check_signal(name: str, unit: str, components: Mapping[str, Component], what: str) -> None:
    component, signal = split_name(name, components, what)
    components[component].variable(signal, "output", "local")
    try:
        declared = components[component].unit(signal)
        if declared is not None:
            conversion(declared, parse_unit(unit))
    except UnitError as error:
        raise ScenarioError(f"{what}: {name} is not in {unit} or convertible to it: {error}.") from error
