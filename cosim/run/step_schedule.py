"""From the components and connections of a scenario to its schedule: the algorithm, and the order of the components."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from cosim.coupling.connection import Connection
from cosim.coupling.graph import Group, execution_groups
from cosim.coupling.instants import Signal, held_signals, recorded_order
from cosim.coupling.strong import topological
from cosim.master.algorithms.choose import AlgorithmChoice
from cosim.run.balise_service import BaliseRoles
from cosim.run.coupled import Coupled
from cosim.scenario.schema import ScenarioTable


@dataclass(frozen=True)
class StepSchedule:
    """How components are stepped.

    Args:
        algorithm: and what it iterates. order: names of the components.
    """

    algorithm: AlgorithmChoice
    order: Sequence[str]


def stepping_groups(table: ScenarioTable, coupled: Coupled, balises: BaliseRoles) -> list[Group]:
    """The components in the groups and the order in which a scenario steps them.

    Before the receivers of telegrams must come the plant, and the odometer whose reading the telegrams carry; what was
    fresh in a run of which a part is played back stays so. First
    where that is free comes the train: the watched plant, else what the report holds observers against; last come those
    with `every`, so that they find the newest inputs.

    Args:
        table: the scenario. coupled: its components and connections. balises: who has to do with them.

    Raises:
        CouplingError: as for `execution_groups`.
    """
    components, connections = coupled.components, coupled.stepped
    odometer = None if table.balises is None else table.balises.odometer
    sources = {balises.plant} | (set() if odometer is None else {odometer.partition(".")[0]})
    before = [(source, name) for source in sorted(sources) for name in balises.receivers if source != name]
    recorded = recorded_order(components, connections)
    if topological(list(components), {*before, *recorded}) is not None:
        before += recorded  # else it contradicts what must be: this is not the run that was recorded
    truth = (table.report.true_position or table.report.true_speed or "").partition(".")[0]
    train = [name for name in (balises.plant or truth,) if name in components]
    slow = [name for name, component in table.components.items() if component.every > 1]
    return execution_groups(components, connections, before, train, slow)


def listeners_that_reorder(
    table: ScenarioTable, coupled: Coupled, balises: BaliseRoles, groups: Sequence[Group]
) -> list[str]:
    """A sentence for each loop whose order follows from connections to components that only listen to it, and which so
    moves otherwise than without them: another of its signals is held over a step.

    Args:
        table: the scenario. coupled: its components and connections. balises: who has to do with them.
        groups: from `stepping_groups`.
    """
    if table.master.algorithm == "jacobi":  # everything is held
        return []
    found = []
    for group in groups:
        members = set(group.names)
        listened = [c for c in coupled.stepped if c.source[0] in members and c.target[0] not in members]
        inside = [c for c in coupled.stepped if c.source[0] in members and c.target[0] in members]
        if len(members) == 1 or not listened:
            continue

        def held(order: Sequence[Group], inside: list[Connection] = inside) -> frozenset[Signal]:
            return held_signals(coupled.components, inside, [name for one in order for name in one.names])

        def without(left_out: Sequence[Connection]) -> list[Group]:
            rest = replace(coupled, routed=[c for c in coupled.routed if c not in left_out])
            return stepping_groups(table, rest, balises)

        now, alone = held(groups), held(without(listened))
        if now != alone:
            one_by_one = [c for c in listened if held(without([c])) != now]
            found.append(_reordered(group.names, one_by_one or listened, now, alone))
    return found


def _reordered(
    names: Sequence[str], because: Sequence[Connection], now: frozenset[Signal], alone: frozenset[Signal]
) -> str:
    return (
        f"The order of stepping is {', '.join(names)} because of {', '.join(map(str, because))}: in this loop "
        f"{_named(now)} is held over a step, where it would be {_named(alone)} if nobody outside listened. So its "
        "signals differ a little from those of the same scenario without; a smaller step makes that smaller."
    )


def _named(signals: frozenset[Signal]) -> str:
    return ", ".join(sorted(map(".".join, signals))) or "no signal"
