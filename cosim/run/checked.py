"""From the task of a run to all that is known before a component is instantiated; cheap checks come first."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass

from cosim.balises.recorded import RecordedLayout
from cosim.master.algorithms.choose import choose_algorithm
from cosim.run.balise_service import BaliseRoles, balise_roles
from cosim.run.checked_observers import Certificates, check_observers
from cosim.run.checked_tables import Stated, complete_tables
from cosim.run.connections import parse_connections
from cosim.run.coupled import Coupled, couple
from cosim.run.layouts import DRAWN_GAPS, make_layout
from cosim.run.loaded_components import LoadedComponents, load_components
from cosim.run.missing_sources import require_sources
from cosim.run.network_remarks import network_warnings
from cosim.run.plausible_masses import mass_warnings
from cosim.run.remarks import Remarks
from cosim.run.step_schedule import StepSchedule, listeners_that_reorder, stepping_groups
from cosim.run.task import RunTask
from cosim.scenario.schema import ScenarioTable


@dataclass(frozen=True)
class Checked:
    """A run that can be set up.

    Args:
        task: with all roles and thresholds. stated: layout and connections. loaded: the components.
        coupled: what hangs together. balises: who has to do with them. schedule: algorithm and order.
        certificates: by component.
    """

    task: RunTask
    stated: Stated
    loaded: LoadedComponents
    coupled: Coupled
    balises: BaliseRoles
    schedule: StepSchedule
    certificates: Certificates


def check_task(task: RunTask, building: Callable[[str], None], remarks: Remarks, resources: ExitStack) -> Checked:
    """Load the components of a run, and check all that is said of them.

    Args:
        task: of the run. building: called for each FMU that is built. remarks: of the run.
        resources: closed when the run ends, which frees the components.

    Raises:
        CosimError: something in the scenario cannot be.
    """
    stated = _parse_tables(task, remarks)
    loaded = load_components(task, building, remarks, resources)
    coupled = couple(task, stated.links, loaded.components)
    remarks.warn(*require_sources(task.table, loaded.components, coupled.connections))
    remarks.warn(*mass_warnings(task.table.components, loaded.components))
    if coupled.network is not None:
        remarks.note(*coupled.network.notes())
        remarks.warn(*network_warnings(coupled.network, task.table, loaded.components, task.where))
    balises = balise_roles(task.table.balises, loaded.components, task.where)
    task = complete_tables(task, coupled, balises, remarks)
    schedule = _make_schedule(task.table, coupled, balises, remarks)
    certificates = check_observers(task, coupled, stated, balises.receivers, remarks)
    return Checked(task, stated, loaded, coupled, balises, schedule, certificates)


def _parse_tables(task: RunTask, remarks: Remarks) -> Stated:
    """What can be checked before a component is loaded."""
    table = task.table
    remarks.warn(*_idle_settings(table))
    layout = None
    if table.balises is not None:
        layout = make_layout(table.balises, table.start, table.stop, task.folder, task.where)
        if isinstance(layout, RecordedLayout):
            remarks.warn(*layout.never_delivered(table.start, table.stop))
    return Stated(layout, parse_connections(table.connections, task.where))


def _idle_settings(table: ScenarioTable) -> list[str]:
    """What the user set that has no effect beside the other settings, in words."""
    master, balises = table.master, table.balises
    doubling = ("master.control = 'doubling'", master.control == "doubling")
    needs = {
        "master.threads": ("master.algorithm = 'jacobi'", master.algorithm == "jacobi" or master.threads == 1),
        "master.tolerance": doubling,
        "master.smallest_step": doubling,
    }
    stated = {f"master.{key}" for key in master.model_fields_set}
    if balises is not None:
        drawn = ("balises.layout = 'aperiodic'", balises.layout == "aperiodic")
        needs |= {f"balises.{key}": drawn for key in DRAWN_GAPS}
        share = balises.position_noise == 0.0 or balises.layout == "csv" or balises.location_accuracy > 0.0
        needs["balises.position_noise"] = ("balises.location_accuracy, of which it is a share", share)
        stated |= {f"balises.{key}" for key in balises.model_fields_set}
    return [
        f"{key} has no effect without {other}." for key, (other, works) in needs.items() if key in stated and not works
    ]


def _make_schedule(table: ScenarioTable, coupled: Coupled, balises: BaliseRoles, remarks: Remarks) -> StepSchedule:
    """Algorithm and order of a scenario."""
    groups = stepping_groups(table, coupled, balises)
    remarks.note(*listeners_that_reorder(table, coupled, balises, groups))
    choice = choose_algorithm(table.master.algorithm, groups, coupled.components)
    return StepSchedule(choice, [name for group in groups for name in group.names])
