"""From the tables of a scenario to layout and connections by name, before any component is loaded; and, once components
are coupled, to the tables with the roles and thresholds that were left open.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cosim.components.component import Component
from cosim.coupling.connection import Link
from cosim.errors import CosimError, ScenarioError
from cosim.expectations.before import Before
from cosim.run.balise_service import BaliseRoles
from cosim.run.coupled import Coupled
from cosim.run.layouts import Layout
from cosim.run.remarks import Remarks
from cosim.run.signal_roles import check_roles, inferred_roles
from cosim.run.task import RunTask
from cosim.scenario.schema import ScenarioTable
from plant_models.explained_error import explained

if TYPE_CHECKING:
    from cosim.scenario.schema import ScenarioTable


def _check_expectations(
    table: ScenarioTable, components: Mapping[str, Component], receivers: Sequence[str], where: str
) -> ScenarioTable:
    """Check the expectations of a scenario against its components."""
    faults, items = [], []
    before = _before(table, components, receivers)
    for place, item in enumerate(table.expect, start=1):
        title = f" ({item.name})" if item.name else ""
        try:
            items.append(_prepared(item, before))
        except CosimError as error:
            faults.append(f"{where}: expect, number {place}{title}, {item.check!r}: {error}")
    if faults:
        raise ScenarioError("\n".join(faults))
    return table.model_copy(update={"expect": items})


def _prepared(item: Any, before: Before) -> Any:
    try:
        prepared = item.prepare(before)
    except CosimError:
        raise
    except Exception as error:  # code of others
        raise CosimError(f"prepare() failed: {explained(error)}") from error
    if not isinstance(prepared, type(item)):
        raise CosimError(f"prepare() returned {type(prepared).__name__}; expected itself or another {item.check!r}.")
    return prepared


def _before(table: ScenarioTable, components: Mapping[str, Component], receivers: Sequence[str]) -> Before:
    return Before(
        start=table.start,
        stop=table.stop,
        period=table.step * table.master.record_every,
        report=table.report,
        tables=table.components,
        components=components,
        receivers=None if table.balises is None else receivers,
        certificates=table.certificates,
    )


@dataclass(frozen=True)
class Stated:
    """What the tables of a scenario say by themselves.

    Args:
        layout: of the balises, None without. links: the connections by name.
    """

    layout: Layout | None
    links: Sequence[Link]


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
        remarks.note(f"Roles that the report was not given: {', '.join(map(' = '.join, roles.items()))}.")
    table = _check_expectations(_with_roles(table, roles), coupled.sources, balises.receivers, task.where)
    return task.with_table(table)


def _with_roles(table: ScenarioTable, roles: Mapping[str, str]) -> ScenarioTable:
    """The scenario whose report has these roles too."""
    return table.model_copy(update={"report": table.report.model_copy(update=dict(roles))}) if roles else table
