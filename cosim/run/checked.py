"""From the task of a run to all that is known before a component is instantiated; cheap checks come first."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass

from cosim.run.balise_service import BaliseRoles, balise_roles
from cosim.run.checked_observers import Certificates, check_observers
from cosim.run.checked_tables import Stated, complete_tables, parse_tables
from cosim.run.coupled import Coupled, couple
from cosim.run.loaded_components import LoadedComponents, load_components
from cosim.run.network_remarks import network_warnings
from cosim.run.remarks import Remarks
from cosim.run.step_schedule import StepSchedule, make_schedule
from cosim.run.task import RunTask


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
    stated = parse_tables(task, remarks)
    loaded = load_components(task, building, remarks, resources)
    coupled = couple(task, stated.links, loaded.components)
    if coupled.network is not None:
        remarks.note(*coupled.network.notes())
        remarks.warn(*network_warnings(coupled.network, task.table, loaded.components, task.where))
    balises = balise_roles(task.table.balises, loaded.components, task.where)
    task = complete_tables(task, coupled, balises, remarks)
    schedule = make_schedule(task.table, coupled, balises)
    certificates = check_observers(task, coupled, stated, balises.receivers, remarks)
    return Checked(task, stated, loaded, coupled, balises, schedule, certificates)
