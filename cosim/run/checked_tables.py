"""From the tables of a scenario to layout and connections by name, before any component is loaded; and, once components
are coupled, to the tables with the roles and thresholds that were left open.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cosim.coupling.connection import Link
from cosim.expectations.check_expectations import check_expectations
from cosim.run.balise_service import BaliseRoles
from cosim.run.connections import parse_connections
from cosim.run.coupled import Coupled
from cosim.run.layouts import Layout, make_layout
from cosim.run.remarks import Remarks
from cosim.run.signal_roles import check_roles, inferred_roles, with_roles
from cosim.run.step_schedule import idle_settings
from cosim.run.task import RunTask


@dataclass(frozen=True)
class Stated:
    """What the tables of a scenario say by themselves.

    Args:
        layout: of the balises, None without. links: the connections by name.
    """

    layout: Layout | None
    links: Sequence[Link]


def parse_tables(task: RunTask, remarks: Remarks) -> Stated:
    """What can be checked before a component is loaded.

    Args:
        task: of the run. remarks: of the run.

    Raises:
        ScenarioError: a layout or a connection that cannot be.
    """
    table = task.table
    remarks.warn(*idle_settings(table.master))
    layout = None
    if table.balises is not None:
        layout = make_layout(table.balises, table.start, table.stop, task.folder, task.where)
    return Stated(layout, parse_connections(table.connections, task.where))


def complete_tables(task: RunTask, coupled: Coupled, balises: BaliseRoles, remarks: Remarks) -> RunTask:
    """Check roles and expectations against the components, and fill in what was left open.

    Args:
        task: of the run. coupled: its components and connections. balises: plant and receivers.
        remarks: of the run.

    Returns:
        The task with the roles of signals that follow from the coupling, and with thresholds of indicators.

    Raises:
        ScenarioError, CouplingError: a role or an expectation names what is not there.
    """
    table = task.table
    check_roles(table, coupled.sources, task.where)
    roles = inferred_roles(table, coupled.components, coupled.connections, balises.plant)
    if roles:
        remarks.note(f"Roles that the report was not told: {', '.join(map(' = '.join, roles.items()))}.")
    table = check_expectations(with_roles(table, roles), coupled.sources, balises.receivers, task.where)
    return task.with_table(table)
