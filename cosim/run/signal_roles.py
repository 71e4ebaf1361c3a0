"""Roles: which signals a report uses. Those it is given exist and are what they should be; others follow from the
coupling.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields

from cosim.components.component import Component
from cosim.coupling.connection import Connection, split_name
from cosim.errors import CosimError, ScenarioError, nearest
from cosim.evaluation.spec import Phase, ReportSpec
from cosim.scenario.scenario_tables import BalisesTable
from cosim.scenario.schema import ScenarioTable
from plant_models.hybrid.units import UnitError, conversion, parse_unit

ROLES = {
    "true_position": "m",
    "true_speed": "m/s",
    "true_slip": "1",
    "true_adhesion_force": "N",
    "true_fault": "1",
    "odometer": "m/s",
    "speed_reference": "m/s",
}


_OF_THE_PLANT = {"true_slip": "slip", "true_adhesion_force": "adhesion_force"}
"""Outputs of the watched plant that have a role where they have this name and the unit of the role."""
ODOMETER, REFERENCE = "odometer", "speed_reference"


def roles_of_balises(balises: BalisesTable | None) -> dict[str, str]:
    """What balises are found by is the true position and speed, and what telegrams carry is the odometer's reading."""
    if balises is None:
        return {}
    found = {"true_position": balises.position, "true_speed": balises.speed, "odometer": balises.odometer}
    return {role: name for role, name in found.items() if name is not None}


def inferred_roles(
    table: ScenarioTable, components: Mapping[str, Component], connections: Sequence[Connection], plant: str
) -> dict[str, str]:
    """The roles that the report table leaves open, as far as balises and connections show them.

    Args:
        table: the scenario. components: by name. connections: checked. plant: that passes the balises; empty for none.

    Returns:
        Signals by role: true position, true speed and odometer from the balises; slip and adhesion force from outputs
        of the plant that are called so; the odometer from what all observers listen to; the reference from the one
        output called so.
    """
    of_the_plant = {role: f"{plant}.{signal}" for role, signal in _OF_THE_PLANT.items()} if plant else {}
    references = (
        f"{name}.{REFERENCE}" for name, component in components.items() if REFERENCE in component.names("output")
    )
    listening = {(name, ODOMETER) for name, component in table.components.items() if component.observer is not None}
    received = {".".join(connection.source) for connection in connections if connection.target in listening}
    known = of_the_plant | {REFERENCE: _only(references), ODOMETER: _only(received)} | roles_of_balises(table.balises)
    free = {role: name for role, name in known.items() if name is not None and getattr(table.report, role) is None}
    return {role: name for role, name in free.items() if _fits(name, role, components)}


def _only(names: Iterable[str]) -> str | None:
    """The name, where there is but one."""
    found = list(names)
    return found[0] if len(found) == 1 else None


def _fits(name: str, role: str, components: Mapping[str, Component]) -> bool:
    try:
        check_signal(name, ROLES[role], components, role)
    except CosimError:
        return False
    component, _, signal = name.partition(".")
    return len(components[component].elements(signal)) == 1


def check_roles(table: ScenarioTable, components: Mapping[str, Component], where: str) -> None:
    """Check the report table of a scenario against its components.

    Args:
        where: name of the scenario, for messages.

    Raises:
        ScenarioError: an observer that is no component, a signal of another dimension, a phase or zone without length.
        CouplingError: a signal that does not exist; the nearest names are suggested.
    """
    report = table.report
    for role, unit in ROLES.items():
        name = getattr(report, role)
        if name is not None:
            check_signal(name, unit, components, f"{where}: report.{role}")
    for name in report.observers or []:
        if name not in components:
            raise ScenarioError(f"{where}: report.observers: no component {name!r}; {nearest(name, components)}")
    for name in report.other_trains:
        for signal, role in (("position", "true_position"), ("speed", "true_speed")):
            check_signal(f"{name}.{signal}", ROLES[role], components, f"{where}: report.other_trains")
    intervals = [(f"report.phases, {p.name!r}", p.start, p.end) for p in report.phases]
    intervals += [(f"report.zones, number {i}", *zone) for i, zone in enumerate(report.zones, start=1)]
    for what, start, end in intervals:
        if not start < end:
            raise ScenarioError(f"{where}: {what}: ends at {end:g} s, before or when it begins at {start:g} s.")


def check_signal(name: str, unit: str | None, components: Mapping[str, Component], what: str) -> None:
    """Check that a signal exists and is of a dimension.

    Args:
        name: ``component.signal``. unit: that its own can be converted to; None for any. components: by name.
        what: place for messages.

    Raises:
        ScenarioError: it is of another dimension. CouplingError: it does not exist; the nearest names are suggested.
    """
    component, signal = split_name(name, components, what)
    components[component].variable(signal, "output", "local")
    try:
        declared = components[component].unit(signal)
        if declared is not None and unit is not None:
            conversion(declared, parse_unit(unit))
    except UnitError as error:
        raise ScenarioError(f"{what}: {name} is not in {unit} or convertible to it: {error}.") from error


def report_spec(table: ScenarioTable) -> ReportSpec:
    """What the report knows of a run.

    Args:
        table: of the scenario, with its roles.
    """
    report, components = table.report, table.components
    observers = [n for n, c in components.items() if c.observer is not None or c.filter is not None]
    as_written = {f.name: getattr(report, f.name) for f in fields(ReportSpec) if hasattr(report, f.name)}
    return ReportSpec(
        **as_written
        | {
            "title": table.title,
            "observers": observers if report.observers is None else report.observers,
            "labels": {n: c.label for n, c in components.items() if c.label is not None},
            "phases": [Phase(p.name, p.start, p.end) for p in report.phases],
        }
    )
