"""From a plan to the services of its run: who finds the balises and delivers telegrams, and who carries packets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from cosim.balises.service import BaliseService
from cosim.components.component import Component
from cosim.coupling.plan import Plan
from cosim.network.service import NetworkService
from cosim.run.balise_service import LocatingChoice, choose_method, make_service
from cosim.run.checked import Checked
from cosim.run.remarks import Remarks
from cosim.scenario.scenario_tables import BalisesTable


@dataclass(frozen=True)
class Services:
    """What acts on components between communication points.

    Args:
        choice: how crossings are found, None without balises. balises, packets: None without balises, without network.
    """

    choice: LocatingChoice | None
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


def _choose(table: BalisesTable, checked: Checked, remarks: Remarks) -> LocatingChoice:
    """How crossings are found, with what speaks against it."""
    plant, loaded, axis = checked.balises.plant, checked.loaded, checked.task.axis
    make, starts = loaded.factories[plant], loaded.starts[plant]
    choice = choose_method(table, loaded.components[plant], make, starts, axis.start, axis.step)
    remarks.warn(*choice.warnings)
    remarks.note(f"Balises localised by '{choice.method}': {choice.reason}.")
    remarks.warn(*_late_telegram_warnings(table, loaded.components, checked.balises.receivers))
    return choice


def _late_telegram_warnings(
    table: BalisesTable, components: Mapping[str, Component], receivers: Sequence[str]
) -> list[str]:
    """A block replays what arrives late, and so does an FMU with the parameter `late_policy`; another one may not."""
    delay = table.latency + table.latency_jitter
    sealed = [n for n in receivers if components[n].kind == "FMU" and "late_policy" not in components[n].variables]
    if not sealed or delay <= 0.0:
        return []
    return [
        f"Telegrams arrive up to {delay:g} s late; {', '.join(sealed)}: a sealed FMU without a parameter late_policy "
        f"does not "
        "say what it does with late stamps."
    ]
