"""From the components and connections of a scenario to its schedule: the algorithm, and the order of the components."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cosim.coupling.graph import Group, execution_groups
from cosim.coupling.instants import recorded_order
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
