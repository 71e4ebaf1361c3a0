"""From observers, gaps and connections to findings about them, with warnings of what speaks against them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from cosim.coupling.connection import Link
from cosim.run.balise_service import BALISE_EVENT
from cosim.run.checked_tables import Stated
from cosim.run.component_models import make_system, values_in_use
from cosim.run.coupled import Coupled
from cosim.run.expected_gaps import ExpectedGap, Sources
from cosim.run.network import is_wired
from cosim.run.observer_findings import evaluate_observers
from cosim.run.remarks import Remarks
from cosim.run.task import RunTask
from cosim.scenario.scenario_tables import ComponentTable

Certificates = dict[str, dict[str, Any]]
"""As plain data, by component."""
_PRINTED = 0.01  # of a bound, by which its three digits in a text may be off


def check_observers(
    task: RunTask, coupled: Coupled, stated: Stated, receivers: Collection[str], remarks: Remarks
) -> Certificates:
    """Evaluate the observers before the run.

    Args:
        task: of the run. coupled: its components and network. stated: layout and connections.
        receivers: components that take telegrams. remarks: of the run.

    Returns:
        Findings about gaps of those that have some.

    Raises:
        CertificateError: the scenario requires certificates, and not all hold.
    """
    tables, mode, where = task.table.components, task.table.certificates, task.where
    certificates, warnings = evaluate_observers(tables, gaps_to_expect(task, coupled, stated, receivers), mode, where)
    warnings += _unused_balises(tables, receivers, stated.links, where)
    warnings += presets_of_other_plants(tables, where)
    warnings += _working_points(tables, stated.links, where)
    remarks.warn(*warnings)
    return certificates


def gaps_to_expect(
    task: RunTask, coupled: Coupled, stated: Stated, receivers: Collection[str]
) -> dict[str, ExpectedGap]:
    """The longest gap that each observer has to expect, by component; none where certificates are ignored.

    Args:
        task, coupled, stated, receivers: as for `check_observers`.
    """
    if task.table.certificates == "ignore":
        return {}
    return Sources(
        task.table, coupled.components, stated.links, stated.layout, receivers, coupled.network, task.where
    ).gaps()


def _unused_balises(
    components: Mapping[str, ComponentTable], receivers: Collection[str], links: Sequence[Link], where: str
) -> list[str]:
    """Observers that are notified of balises and give them no weight, while nothing else gives them a position.

    Args:
        components: tables of all components by name. receivers: names of those that take telegrams. links: all
            connections. where: name of the scenario, for messages.
    """
    warnings = []
    for name in (name for name in receivers if components[name].observer is not None):
        system: Any = make_system(components[name], where)
        if not hasattr(system, "listens") or system.listens(values_in_use(components[name], system)) > 0.0:
            continue
        others = [event.name for event in system.triggered_events if event.name != BALISE_EVENT]
        read = [signal.name for signal in system.inputs if signal.name.endswith("_position")]
        wired = [event for event in others if is_wired(links, name, event)]
        wired += [signal for signal in read if any(target == f"{name}.{signal}" for _, target, *_ in links)]
        if not wired:
            waits = " or ".join([*(f"event {event!r}" for event in others), *(f"input {s!r}" for s in read)])
            warnings.append(
                f"{name}: balises do not act on it, for their gain is 0 and nothing is connected "
                f"to its {waits or 'position'}: its position is what its model makes of the start. Take a preset that "
                f"uses balises, or connect what it waits for."
            )
    return warnings


def _working_points(components: Mapping[str, ComponentTable], links: Sequence[Link], where: str) -> list[str]:
    """What components say against the values that they are given, and readings noisier than is stated of them.

    Args:
        components: tables of all components by name. links: all connections. where: name of the scenario, for
            messages.
    """
    systems: dict[str, Any] = {name: make_system(table, where) for name, table in components.items()}
    warnings = [
        f"{name}: {warning}"
        for name, system in systems.items()
        if hasattr(system, "working_point")
        for warning in system.working_point(values_in_use(components[name], system))
    ]
    for source, target, *_ in links:
        (sensor, output), (name, read) = source.split(".", 1), target.split(".", 1)
        stated = getattr(systems.get(name), "stated_bounds", {}).get(read)
        if stated is None or not hasattr(systems.get(sensor), "reading_bound"):
            continue
        arrives = systems[sensor].reading_bound(output, values_in_use(components[sensor], systems[sensor]))
        believed = getattr(values_in_use(components[name], systems[name]), stated)
        if arrives > believed * (1.0 + _PRINTED):
            warnings.append(
                f"{name}: noise and teeth move readings of {source} by up to {float(arrives):.3g} m/s, and {stated} is "
                f"{float(believed):.3g} m/s: noise is taken for faults. Set {name}.{stated} to the former."
            )
    return warnings


def presets_of_other_plants(components: Mapping[str, ComponentTable], where: str) -> list[str]:
    """Observers with a preset that was made for another plant than the one that their parameters describe.

    Args:
        components: tables of all components by name. where: name of the scenario, for messages.
    """
    warnings = []
    for name, table in components.items():
        system: Any = make_system(table, where) if table.observer is not None else None
        made_for = getattr(system, "made_for", {}).get(table.preset)
        if made_for is None:
            continue
        values = values_in_use(table, system)._asdict()
        warnings += [
            f"{name}: preset {table.preset!r} is made for {made_for.what}, {parameter} from {low:g} to {high:g}, and "
            f"here {parameter} = {float(values[parameter]):g}; {made_for.instead}."
            for parameter, (low, high) in made_for.ranges.items()
            if not low <= float(values[parameter]) <= high
        ]
    return warnings
