"""From the task of a run to the findings about its observers: what the run would evaluate; nothing is built or run."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from cosim.certify.demands import Certified, Demands, certified
from cosim.run.balise_service import balise_roles
from cosim.run.checked_observers import gaps_to_expect
from cosim.run.checked_tables import Stated
from cosim.run.component_models import make_system, stated_parameters
from cosim.run.connections import parse_connections
from cosim.run.coupled import couple
from cosim.run.described_components import describe_component
from cosim.run.expected_gaps import ExpectedGap
from cosim.run.layouts import make_layout
from cosim.run.observer_findings import evaluated
from cosim.run.task import RunTask
from cosim.scenario.scenario_tables import ComponentTable


def scenario_observers(task: RunTask, demands: Demands) -> Iterator[Certified]:
    """The finding that decides of each observer of a scenario, for the gaps that it has to expect.

    Args:
        task: that would be run. demands: a gap is held against in place of the expected one.

    Raises:
        CosimError: a component, connection or balise role that cannot be.
    """
    with task.named_in_errors():
        gaps = _gaps(task)
        for name, table in task.table.components.items():
            system: Any = make_system(table, task.where) if table.observer is not None else None
            if hasattr(system, "findings"):
                yield _of_observer(name, table, system, gaps.get(name), demands)


def _gaps(task: RunTask) -> dict[str, ExpectedGap]:
    table, where = task.table, task.where
    span = table.start, table.stop
    links, layout = parse_connections(table.connections, where), None
    components = {
        name: describe_component(name, one, task.folder, f"{where}: components.{name}", span, links)
        for name, one in table.components.items()
    }
    coupled, roles = couple(task, links, components), balise_roles(table.balises, components, where)
    if table.balises is not None:
        layout = make_layout(table.balises, table.start, table.stop, task.folder, where)
    return gaps_to_expect(task, coupled, Stated(layout, links), roles.receivers)


def _of_observer(
    name: str, table: ComponentTable, system: Any, expected: ExpectedGap | None, demands: Demands
) -> Certified:
    gap = expected if demands.gap is None else ExpectedGap(demands.gap, "asked for")
    found, warnings = evaluated(name, table, system, gap)
    in_use = stated_parameters(table, system), table.preset
    further = certified(name, system, replace(demands, gap=None if found else demands.gap), *in_use)
    first = further.findings[0] if found is None else found
    of_gap = () if found is None or found.demand is None else (found,)
    notes = () if of_gap else tuple(warnings)
    return Certified(name, (first, *further.demanded), (*of_gap, *further.demanded), notes)
