"""From a checked run to one that is ready for its first step: components instantiated, plan, services, master."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass

from cosim.components.component import Component
from cosim.components.fmi3 import FMI3Component
from cosim.components.logged_slave import log_calls
from cosim.components.recording import RecordingComponent
from cosim.components.start_values import StartValue
from cosim.coupling.instants import followed
from cosim.coupling.plan import Plan, make_plan
from cosim.diagnostics.call_log import CallLog
from cosim.errors import OutputError
from cosim.master.interpolation.attach import attach_interpolators
from cosim.master.master import Master, close
from cosim.results.stream import Stream
from cosim.run.checked import Checked
from cosim.run.coupled import Coupled
from cosim.run.coupling_warnings import coupling_warnings
from cosim.run.master_setup import make_master, make_recorder
from cosim.run.remarks import Remarks
from cosim.run.services import Services, make_services
from cosim.run.signal_roles import ROLES, report_spec
from cosim.run.streaming import Streaming
from cosim.run.summary import first_summary
from cosim.run.task import RunTask
from cosim.scenario.scenario_tables import ComponentTable
from cosim.scenario.schema import ScenarioTable

Progress = Callable[[float, float], None]


@dataclass(frozen=True)
class Ready:
    """A run before its first step.

    Args:
        checked: task, components and connections. services: of the run. master: with the plan.
        stream: that rows go to, or None.
    """

    checked: Checked
    services: Services
    master: Master
    stream: Stream | None

    @property
    def task(self) -> RunTask:
        """What is to be run, with all roles and thresholds."""
        return self.checked.task

    @property
    def coupled(self) -> Coupled:
        """Components and connections."""
        return self.checked.coupled


def make_ready(
    checked: Checked,
    progress: Progress | None,
    call_log: CallLog | None,
    streaming: Streaming | None,
    remarks: Remarks,
    resources: ExitStack,
) -> Ready:
    """Set up a run.

    Args:
        checked: task, components and connections. progress: called with the time reached and the end [s].
        call_log: where calls are logged; None for nowhere. streaming: what a stream needs; None for none.
        remarks: of the run. resources: closed when the run ends.

    Raises:
        CosimError: a component cannot be instantiated, or cannot do what is asked for.
    """
    table = checked.task.table
    _instantiate_components(table, checked.coupled, checked.loaded.starts, call_log)
    plan = _plan_run(table, checked.coupled, checked.schedule.order)
    resources.callback(close, plan)
    _remark_coupling(checked, plan, remarks)
    services = make_services(checked, plan, remarks)
    master = make_master(checked.task, plan, services, checked.schedule.algorithm, progress)
    remarks.note(*_master_notes(master))
    stream = None if streaming is None else _begin_stream(streaming, checked, services, master, remarks)
    return Ready(checked, services, master, stream)


def _remark_coupling(checked: Checked, plan: Plan, remarks: Remarks) -> None:
    """What to know of the coupling; interpolators are attached to the plan."""
    table, coupled = checked.task.table, checked.coupled
    warnings, notes = coupling_warnings(table, coupled.components, coupled.connections)
    remarks.warn(*warnings)
    remarks.note(*notes, *checked.schedule.algorithm.notes)
    interpolators = attach_interpolators(plan, table.master.inputs)
    remarks.note(*_recording_notes(coupled.components, table.components))
    if table.master.inputs != "hold":
        remarks.note(_interpolation_note(interpolators, table.master.inputs))


def _master_notes(master: Master) -> list[str]:
    """What the choice of the stepper and of what is done at events explains."""
    events, network = master.system.events, master.system.network
    notes = [*([] if events is None else events.notes), *master.stepper.notes]
    if network is not None and master.stepper.compiled is not None:
        notes.append(
            "Packets are sent and delivered by Python: the compiled stepper halts at points with one, "
            "and takes steps with one inside in parts."
        )
    return notes


_CARRIED = {
    "derivatives": "value and slope to",
    "intermediate": "set within the step of",
    "mean": "mean over the step to",
    "held": "held, because discrete, for",
}


def _interpolation_note(interpolators: Mapping[str, str], inputs: str) -> str:
    """How components are informed of inputs that follow a line."""
    by_interpolator: dict[str, list[str]] = {}
    for name, interpolator in interpolators.items():
        by_interpolator.setdefault(interpolator, []).append(name)
    said = "; ".join(f"{_CARRIED[interpolator]}: {', '.join(names)}" for interpolator, names in by_interpolator.items())
    return f"Inputs between communication points ({inputs}): {said or 'none are connected'}."


def _recording_notes(components: Mapping[str, Component], tables: Mapping[str, ComponentTable]) -> list[str]:
    """Which columns of tables are held and which are lines, where the scenario leaves that to the targets."""
    notes = []
    for name, component in components.items():
        if not isinstance(component, RecordingComponent) or component.recording.of_run:
            continue
        if tables[name].interpolation is not None:
            continue
        held, lines = sorted(component.held_outputs), sorted(component.line_outputs)
        said = [f"held from row to row: {', '.join(held)}"] if held else []
        said += [f"on lines between rows: {', '.join(lines)}"] if lines else []
        if said:
            notes.append(f"{name}: {'; '.join(said)}. Where that is wrong say so by 'interpolation'.")
    return notes


def _plan_run(table: ScenarioTable, coupled: Coupled, order: Sequence[str]) -> Plan:
    """The plan of a run; the components must be instantiated."""
    recorded, network = _signals_to_record(table), coupled.network
    if network is not None:
        for name, signals in network.hidden(coupled.components).items():
            recorded[name] += [signal for signal in signals if signal not in recorded[name]]
    outputs = None if network is None else network.outputs
    return make_plan(coupled.sources, coupled.routed, order, recorded, coupled.clocks, outputs)


def _signals_to_record(table: ScenarioTable) -> dict[str, list[str]]:
    """What is recorded besides the outputs, by component: what its table, balises, report and expectations name."""
    record = {name: list(component.record) for name, component in table.components.items()}
    used = [getattr(table.report, role) for role in ROLES]
    used += [] if table.balises is None else [table.balises.position, table.balises.speed, table.balises.odometer]
    used += [getattr(item, key, None) for item in table.expect for key in ("signal", "reference")]
    for name in filter(None, used):
        component, _, signal = name.partition(".")
        if component in record and signal not in record[component]:
            record[component].append(signal)
    return record


def _instantiate_components(
    table: ScenarioTable, coupled: Coupled, starts: Mapping[str, Mapping[str, StartValue]], call_log: CallLog | None
) -> None:
    """Instantiate the components, and set their start values."""
    moving = followed(coupled.components, coupled.connections)
    every = table.master.inputs != "hold"
    for name, component in coupled.components.items():
        if isinstance(component, FMI3Component):
            own = [c for c in coupled.connections if c.target[0] == name and (every or c.source_variable in moving)]
            component.request_intermediate_updates([c.target[1] for c in own])
        component.choose_log(table.components[name].log)
        if call_log is not None:
            log_calls(component, call_log)
        component.instantiate()
        for parameter, value in starts[name].items():
            component.set_start(parameter, value)


def _begin_stream(
    streaming: Streaming, checked: Checked, services: Services, master: Master, remarks: Remarks
) -> Stream | None:
    """From here on what is recorded, delivered and logged is in the folder as well; nothing is, where a spare folder
    cannot be made.
    """
    table, signals = checked.task.table, master.plan.signals
    summary = first_summary(checked.task, master.plan) | {"report": asdict(report_spec(table))}
    summary |= {"certificates": checked.certificates, "warnings": remarks.warnings, "notes": remarks.notes}
    events = [] if services.balises is None else services.balises.mailbox.log
    logs = [component.messages for component in checked.coupled.components.values()]
    packets = None if services.packets is None else services.packets.settled
    rows = table.master.record_every * master.recorder.room
    try:
        stream = Stream(streaming.folder, signals, checked.coupled.unit, summary, lambda: events, logs, packets)
        master.recorder = make_recorder(table, signals, rows, stream)
    except OutputError as error:
        if not streaming.spare:
            raise
        remarks.warn(f"Until its end the run is in memory alone, lost if its process dies: {error}")
        return None
    streaming.begun()
    return stream
