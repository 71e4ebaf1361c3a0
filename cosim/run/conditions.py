"""Conditions before the run: observers whose states their measurements do not tell, or whose gains cannot be stable."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from cosim.coupling.connection import Link
from cosim.errors import CertificateError
from cosim.run.balise_service import BALISE_EVENT
from cosim.run.component_models import given_parameters, make_system, values_in_use
from cosim.run.network import is_wired
from cosim.scenario.scenario_tables import ComponentTable
from plant_models.disk_cache.entries import remembered
from plant_models.disk_cache.identity import identity

PRINTED = 0.01  # of a bound, by which its three digits in a text may be off


def check_conditions(components: Mapping[str, ComponentTable], mode: str, where: str) -> list[str]:
    """What speaks against the observers that state a condition; those with a certificate are judged by that instead.

    Args:
        components: tables of all components by name. mode: ``warn``, ``require`` or ``ignore``.
        where: name of the scenario, for messages.

    Returns:
        Warnings: conditions that do not hold, and states that a window does not tell.

    Raises:
        CertificateError: `mode` is ``require`` and there is such a warning.
    """
    warnings: list[str] = []
    if mode == "ignore":
        return warnings
    for name, table in components.items():
        if table.observer is None:
            continue
        system: Any = make_system(table, where)
        if hasattr(system, "condition") and not hasattr(system, "certify"):
            warnings += [f"{name}: {doubt}" for doubt in _known_doubts(name, table, system)]
    if mode == "require" and warnings:
        raise CertificateError(f"{where}: certificates = 'require' and not all hold.\n" + "\n".join(warnings))
    return warnings


def deaf_receivers(
    components: Mapping[str, ComponentTable], receivers: Collection[str], links: Sequence[Link], where: str
) -> list[str]:
    """Observers that are told of balises and give them no weight, while nothing else tells them a position.

    Args:
        components: tables of all components by name. receivers: names of those that are told of balises. links: all
            connections. where: name of the scenario, for messages.
    """
    doubts = []
    for name in (name for name in receivers if components[name].observer is not None):
        system: Any = make_system(components[name], where)
        if not hasattr(system, "listens") or system.listens(values_in_use(components[name], system)) > 0.0:
            continue
        others = [event.name for event in system.triggered_events if event.name != BALISE_EVENT]
        read = [signal.name for signal in system.inputs if signal.name.endswith("_position")]
        told = [event for event in others if is_wired(links, name, event)]
        told += [signal for signal in read if any(target == f"{name}.{signal}" for _, target, *_ in links)]
        if not told:
            waits = " or ".join([*(f"event {event!r}" for event in others), *(f"input {s!r}" for s in read)])
            doubts.append(
                f"{name}: balises do not act on it, for their gain is 0 with these parameters, and nothing tells its "
                f"{waits or 'position'}: its position is what its model makes of the start. Take a preset that uses "
                f"balises, or connect what it waits for."
            )
    return doubts


def left_working_points(components: Mapping[str, ComponentTable], links: Sequence[Link], where: str) -> list[str]:
    """What components say against the values that they are given, and readings with more noise than is told of them.

    Args:
        components: tables of all components by name. links: all connections. where: name of the scenario, for
            messages.
    """
    systems: dict[str, Any] = {name: make_system(table, where) for name, table in components.items()}
    doubts = [
        f"{name}: {doubt}"
        for name, system in systems.items()
        if hasattr(system, "working_point")
        for doubt in system.working_point(values_in_use(components[name], system))
    ]
    for source, target, *_ in links:
        (sensor, output), (name, read) = source.split(".", 1), target.split(".", 1)
        told = getattr(systems.get(name), "stated_bounds", {}).get(read)
        if told is None or not hasattr(systems.get(sensor), "reading_bound"):
            continue
        arrives = systems[sensor].reading_bound(output, values_in_use(components[sensor], systems[sensor]))
        believed = getattr(values_in_use(components[name], systems[name]), told)
        if arrives > believed * (1.0 + PRINTED):
            doubts.append(
                f"{name}: noise and teeth move readings of {source} by up to {float(arrives):.3g} m/s, and {told} is "
                f"{float(believed):.3g} m/s: noise is taken for faults. Set {name}.{told} to the former."
            )
    return doubts


def other_plants(components: Mapping[str, ComponentTable], where: str) -> list[str]:
    """Observers with a preset that was made for another plant than the one that their parameters tell of.

    Args:
        components: tables of all components by name. where: name of the scenario, for messages.
    """
    doubts = []
    for name, table in components.items():
        system: Any = make_system(table, where) if table.observer is not None else None
        made_for = getattr(system, "made_for", {}).get(table.preset)
        if made_for is None:
            continue
        values = values_in_use(table, system)._asdict()
        doubts += [
            f"{name}: preset {table.preset!r} is made for {made_for.what}, {parameter} from {low:g} to {high:g}, and "
            f"here {parameter} = {float(values[parameter]):g}; {made_for.instead}."
            for parameter, (low, high) in made_for.ranges.items()
            if not low <= float(values[parameter]) <= high
        ]
    return doubts


def _known_doubts(name: str, table: ComponentTable, system: Any) -> list[str]:
    """What `_doubts` says, from the cache where it was asked before."""
    asked = name, system, table.preset, given_parameters(table, system)
    key = identity(asked, code=("fmu_observer", "cosim/run/conditions.py"))
    return remembered("condition", key, lambda: _doubts(table, system))  # type: ignore[no-any-return]


def _doubts(table: ComponentTable, system: Any) -> list[str]:
    """What the condition of one observer says against it, or why it cannot be judged."""
    try:
        condition = system.condition(given_parameters(table, system), table.preset)
    except (ValueError, ArithmeticError) as error:
        return [f"its condition cannot be judged with these parameters: {error}."]
    refuted = [] if condition.holds else [f"its condition {condition.explain()}"]
    return [*refuted, *(f"{doubt}." for doubt in condition.warnings)]
