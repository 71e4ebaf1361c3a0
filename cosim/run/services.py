"""From a plan to the services of its run: who finds the balises and delivers telegrams, and who carries packets."""

from __future__ import annotations

from dataclasses import dataclass

from cosim.balises.service import BaliseService
from cosim.coupling.plan import Plan
from cosim.network.service import NetworkService
from cosim.run.balise_service import Choice, choose_method, make_service
from cosim.run.checked import Checked
from cosim.run.coupling_warnings import late_telegram_warnings
from cosim.run.remarks import Remarks
from cosim.scenario.scenario_tables import BalisesTable


@dataclass(frozen=True)
class Services:
    """What acts on components between communication points.

    Args:
        choice: how crossings are found, None without balises. balises, packets: None without balises, without network.
    """

    choice: Choice | None
    balises: BaliseService | None
    packets: NetworkService | None


def make_services(checked: Checked, plan: Plan, remarks: Remarks) -> Services:
    """The services of a run; the watched plant is probed, where that is not known from before.

    Args:
        checked: task, components and connections. plan: prepared, components instantiated. remarks: of the run.

    Raises:
        CosimError: crossings cannot be found, or a signal is not recorded.
    """
    choice = balises = packets = None
    layout, network, task = checked.stated.layout, checked.coupled.network, checked.task
    if layout is not None and task.table.balises is not None:
        choice = _choose(task.table.balises, checked, remarks)
        balises = make_service(task.table.balises, layout, plan, checked.balises, choice)
    if network is not None:
        packets = network.service(plan, task.axis.start)
    return Services(choice, balises, packets)


def _choose(table: BalisesTable, checked: Checked, remarks: Remarks) -> Choice:
    """How crossings are found, with what speaks against it."""
    plant, loaded, axis = checked.balises.plant, checked.loaded, checked.task.axis
    make, starts = loaded.factories[plant], loaded.starts[plant]
    choice = choose_method(table, loaded.components[plant], make, starts, axis.start, axis.step)
    remarks.warn(*choice.warnings)
    remarks.note(f"Balises localised by '{choice.method}': {choice.reason}.")
    remarks.warn(*late_telegram_warnings(table, loaded.components, checked.balises.receivers))
    return choice
