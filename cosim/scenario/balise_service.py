"""The balise service of a run: who is watched, how passings are found, who is told."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from cosim.balises.delivery import Receiver
from cosim.balises.localise import Localiser, Method, choose, make_localiser
from cosim.balises.recorded import RecordedChannel, RecordedLayout, RecordedLocaliser
from cosim.balises.service import BaliseService
from cosim.balises.telegram import Channel, FalseTelegram
from cosim.balises.watch import Watch
from cosim.components.component import Component
from cosim.components.recording import KIND as RECORDING
from cosim.coupling.connection import SOURCES, split_name
from cosim.coupling.plan import Plan
from cosim.errors import CouplingError, ScenarioError
from cosim.scenario.layouts import Layout
from cosim.scenario.tables import BalisesTable
from fmus.check.probe import ProbeReport, probe
from plant_models.hybrid.units import UnitError, conversion, parse_unit

BALISE_EVENT = "balise"
ASKED_FOR = "asked for in the scenario"
AS_RECORDED = "they are told as they were in an earlier run"
PLAYED_BACK = "the plant is a recording, which goes to any time and back"


@dataclass
class Choice:
    """The localisation method of a run.

    Args:
        method: its name. reason: why it was chosen. probe: what the plant was seen to do, where it was probed.
        warnings: what speaks against it.
    """

    method: Method
    reason: str
    probe: ProbeReport | None = None
    warnings: list[str] = field(default_factory=list)


def find_receivers(table: BalisesTable, components: Mapping[str, Component], plant: str, where: str) -> list[str]:
    """Names of the components that are told of balises: those listed, or all but the plant that declare the event.

    Raises:
        ScenarioError: one that is listed does not declare the event.
    """
    able = [name for name, component in components.items() if BALISE_EVENT in component.events and name != plant]
    if table.receivers is None:
        return able
    for name in table.receivers:
        if name not in able:
            raise ScenarioError(
                f"{where}: balises.receivers: {name!r} declares no event '{BALISE_EVENT}'; these do: {', '.join(able) or 'none'}."
            )
    return table.receivers


def watched_plant(table: BalisesTable, components: Mapping[str, Component], where: str) -> str:
    """Name of the component whose position finds the balises; of recorded telegrams, for which none is needed, of a recording.

    Raises:
        ScenarioError: position and speed are not of one component, or are neither outputs nor locals.
    """
    if table.position is None or table.speed is None:
        plant = next((name for name, component in components.items() if component.kind == RECORDING), "")
        if not plant:
            raise ScenarioError(
                f"{where}: balises: no component is a recording; say with 'position' and 'speed' what the plant is."
            )
        return _checked(table, plant, components, where, "odometer")
    plant, _ = split_name(table.position, components, f"{where}: balises.position")
    other, _ = split_name(table.speed, components, f"{where}: balises.speed")
    if plant != other:
        raise ScenarioError(f"{where}: balises.position and balises.speed must be of one component, got {plant} and {other}.")
    return _checked(table, plant, components, where, "position", "speed", "odometer")


def _checked(table: BalisesTable, plant: str, components: Mapping[str, Component], where: str, *keys: str) -> str:
    """The plant, once the signals that these keys name are known to exist."""
    for key in keys:
        name = getattr(table, key)
        if name is not None:
            component, signal = split_name(name, components, f"{where}: balises.{key}")
            components[component].variable(signal, *SOURCES)
    return plant


def choose_method(
    table: BalisesTable, component: Component, make: Callable[[], Component], starts: Mapping[str, Any],
    start: float, step: float,
) -> Choice:  # fmt: skip
    """The localisation method: asked for, or the best that the probed plant allows.

    Args:
        table: balise table. component: the watched plant. make: makes a fresh one to probe. starts: its start values.
        start: start of the run [s]. step: communication step [s].
    """
    if table.layout == "recorded":
        return Choice("recorded", AS_RECORDED)
    if table.method in ("early-return", "interpolate"):
        return Choice(table.method, ASKED_FOR)
    if component.kind == RECORDING:
        return Choice("rollback", PLAYED_BACK) if table.method == "auto" else Choice(table.method, ASKED_FOR)
    report = probe(make, starts, start, step)
    chosen, reason = choose(report.honest_step, report.exact_state, table.clock)
    if table.method == "auto":
        return Choice(chosen, reason, report)
    choice = Choice(table.method, ASKED_FOR, report)
    if not report.honest_step or (table.method == "rollback" and not report.exact_state):
        choice.warnings.append(
            f"balises.method = '{table.method}' although the probe of '{component.name}' advises '{chosen}': {reason}."
        )
    return choice


def make_service(
    table: BalisesTable, layout: Layout, plan: Plan, plant: str, receivers: Sequence[str], method: Method
) -> BaliseService:
    """Everything about balises for the master."""
    planned = plan.find(plant)
    first = planned.columns.start
    watch = Watch(planned, 0, 0)  # where telegrams are recorded nobody looks at them
    if table.position is not None and table.speed is not None:
        position, speed = (plan.column(name) - first for name in (table.position, table.speed))
        scales = [_scale(planned.component, name, unit) for name, unit in ((table.position, "m"), (table.speed, "m/s"))]
        watch = Watch(planned, position, speed, *scales)
    localiser, channel = _sources(table, layout, watch, method)
    told = [Receiver(plan.find(name), BALISE_EVENT, table.timing) for name in receivers]
    odometer = None if table.odometer is None else plan.column(table.odometer)
    return BaliseService(localiser, channel, told, odometer, first + watch.position_column)


def _sources(table: BalisesTable, layout: Layout, watch: Watch, method: Method) -> tuple[Localiser, Channel]:
    """Who finds the passings, and what happens to the telegrams."""
    if isinstance(layout, RecordedLayout):
        return RecordedLocaliser(watch, layout), RecordedChannel(records=layout.records)
    channel = Channel(
        latency=table.latency,
        latency_jitter=table.latency_jitter,
        missed_fraction=table.missed_fraction,
        missed=frozenset(table.missed),
        position_noise=table.position_noise,
        false_telegrams=tuple(FalseTelegram(f.time, f.offset) for f in table.false_telegrams),
        seed=table.seed,
    )
    return make_localiser(method, watch, layout, table.clock, table.jerk_bound), channel


def _scale(component: Component, name: str, unit: str) -> float:
    """Factor from the plant's own unit to [m] or [m/s]; 1 where it declares none."""
    try:
        declared = component.unit(name.partition(".")[2])
        return 1.0 if declared is None else conversion(declared, parse_unit(unit))[0]
    except UnitError as error:
        raise CouplingError(f"{name} cannot be read in {unit} to find balises: {error}.") from error
