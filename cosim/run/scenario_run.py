"""Running a validated scenario: make the components, couple them, check, step, and gather the result."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from cosim.balises.service import BaliseService
from cosim.components.component import Component
from cosim.components.fmi3 import FMI3Component
from cosim.components.logged_slave import log_calls
from cosim.components.start_values import StartValue
from cosim.components.surroundings import SurroundingsOfSteps
from cosim.coupling.clocks import ClockConnection, connect_clocks
from cosim.coupling.connection import Connection, Link, connect
from cosim.coupling.instants import followed, settle_recordings
from cosim.coupling.plan import Plan, make_plan
from cosim.diagnostics.call_log import CallLog
from cosim.diagnostics.messages import in_order
from cosim.errors import CosimError
from cosim.evaluation.result_warnings import result_warnings
from cosim.expectations.check_expectations import check_expectations
from cosim.expectations.judge import judge
from cosim.master.algorithms.choose import AlgorithmChoice, choose_algorithm
from cosim.master.axis import TimeAxis
from cosim.master.interpolation.attach import attach_interpolators
from cosim.master.master import Master, close
from cosim.network.outputs import NAME as NETWORK
from cosim.network.service import NetworkService
from cosim.process.interruption import Interruption
from cosim.process.sentinel import limited_calls
from cosim.results.result import Result, SignalInfo
from cosim.results.si import InFormerUnits, in_si
from cosim.results.stream import Stream
from cosim.run.after_run import missed_samples, warnings_after
from cosim.run.balise_service import Choice, choose_method, find_receivers, make_service, watched_plant
from cosim.run.balise_summary import all_telegrams, balise_summary
from cosim.run.certificates import check_certificates
from cosim.run.component_models import component_factories, protocol_parameters
from cosim.run.conditions import check_conditions, deaf_receivers, left_working_points, other_plants
from cosim.run.connections import parse_connections
from cosim.run.coupling_warnings import (
    coupling_warnings,
    interpolation_note,
    late_telegram_warnings,
    recording_notes,
)
from cosim.run.expected_gaps import Sources
from cosim.run.layouts import Layout, make_layout
from cosim.run.master_setup import idle_settings, make_master, make_recorder, stepping_groups
from cosim.run.network import Network, connect_over, make_network, network_summary, network_warnings
from cosim.run.once_per_process import check_instances
from cosim.run.outcome import INTERRUPTED, Outcome
from cosim.run.premises import premise_findings
from cosim.run.run_seeds import component_seed, with_seeds
from cosim.run.signal_roles import check_roles, inferred_roles, report_spec, signals_to_record, with_roles
from cosim.run.starts import start_values
from cosim.run.summary import first_summary, judged_summary, run_summary
from cosim.scenario.schema import ScenarioTable, step_count
from cosim.structure.divergence import explained_failure
from fmus.fmi.capabilities import tool_warning
from fmus.fmi.sense import doubled_names
from plant_models.hybrid.units import Unit

LOG = logging.getLogger("cosim")
CALL_LOG = Path("calls.log")
Progress = Callable[[float, float], None]
Warn = Callable[[str], None]
Streaming = tuple[Path, Callable[[], None]]
"""The folder to stream to, and whom to tell that this has begun: nothing of a former run is in it then."""


def run_scenario(
    table: ScenarioTable,
    name: str,
    folder: Path,
    where: str,
    progress: Progress | None = None,
    warn: Warn | None = None,
    call_log: Path | None = None,
    building: Warn | None = None,
    stream: Streaming | None = None,
    doubts: Sequence[str] = (),
    finish: Callable[[Outcome], Outcome] = lambda outcome: outcome,
) -> Outcome:
    """Run a scenario to its end or to its first failure.

    Args:
        table: validated scenario. name: its name. folder: start of relative paths. where: place for messages.
        progress: called with the time reached and the end [s].
        warn: told of everything doubtful as soon as it is known, before the run where it can be; by default the log
            ``cosim``.
        call_log: where calls are logged, where the scenario asks for that; by default `CALL_LOG` in the working folder.
        building: told of FMUs that are built before the run, as they are done; by default the log, as information.
        stream: the folder that rows are written to as they come; None to keep them in memory.
        doubts: warnings from before, which have been told already.
        finish: called with the outcome before any component is closed, since an FMU may take the process along there;
            what it returns is returned.

    Raises:
        CosimError: the scenario cannot be set up; failures on the way are in the outcome.
    """
    setup = _Setup(table, folder, where, warn or LOG.warning, building or LOG.info)
    if table.master.log_calls:
        setup.call_log = CallLog(call_log or CALL_LOG)
    setup.name, setup.streaming = name, stream
    setup.warnings += doubts
    try:
        with limited_calls(table.master.call_timeout):
            try:
                setup.prepare(progress)
            except CosimError as error:
                raise error if str(error).startswith(where) else type(error)(f"{where}: {error}") from error
            with Interruption() as interruption:
                outcome = finish(setup.execute(interruption))
        if outcome.failure is None:
            interruption.check()  # it came while the results were put away
        return outcome
    finally:
        setup.close()


class _Setup:
    """The parts of one run while it is put together; thrown away at its end."""

    def __init__(self, table: ScenarioTable, folder: Path, where: str, tell: Warn, building: Warn) -> None:
        self.table, self.folder, self.where = with_seeds(table), folder, where
        self.axis = TimeAxis(table.start, table.step, step_count(table.start, table.stop, table.step))
        self.warnings: list[str] = []
        self._tell, self._tell_of_builds = tell, building
        self.notes: list[str] = []
        self.certificates: dict[str, dict[str, Any]] = {}
        self.factories: dict[str, Callable[[], Component]] = {}
        self.components: dict[str, Component] = {}
        self.connections: list[Connection] = []
        self.plan: Plan | None = None
        self.choice: Choice | None = None
        self.algorithm = AlgorithmChoice()
        self.service: BaliseService | None = None
        self.network: Network | None = None
        self.packets: NetworkService | None = None
        self.master: Master | None = None
        self.interpolators: Mapping[str, str] = {}
        self.setup_seconds = 0.0
        self.call_log: CallLog | None = None
        self.name = "script"
        self.streaming: Streaming | None = None
        self.stream: Stream | None = None

    def prepare(self, progress: Progress | None) -> None:
        """Everything up to the first step, cheap checks first."""
        begin = perf_counter()
        table = self.table
        for text in idle_settings(table.master):
            self._warn(text)
        layout = None
        if table.balises is not None:
            layout = make_layout(table.balises, table.start, table.stop, self.folder, self.where)
        links = pairs = parse_connections(table.connections, self.where)
        self._load_components()
        clocks, pairs = connect_clocks(pairs, self.components)
        connections, routed = self._connect(pairs)
        self.connections = connections
        receivers, plant = self._balise_roles()
        known = self._with_network()
        check_roles(table, known, self.where)
        roles = inferred_roles(table, self.components, connections, plant)
        table = with_roles(table, roles)
        if roles:
            self.notes.append(f"Roles that the report was not told: {', '.join(map(' = '.join, roles.items()))}.")
        table = self.table = check_expectations(table, known, receivers, self.where)
        stepped = [c for c in routed if c.source[0] != NETWORK]
        groups = stepping_groups(table, self.components, stepped, plant, receivers)
        self.algorithm = choose_algorithm(table.master.algorithm, groups, self.components)
        order = [name for group in groups for name in group.names]
        starts = {n: self._start_values(n, c) for n, c in self.components.items()}
        self._check_certificates(layout, receivers, links)
        self._instantiate(starts, connections)
        self.plan = self._make_plan(routed, order, clocks)
        doubts, notes = coupling_warnings(table, self.components, connections)
        for doubt in doubts:
            self._warn(doubt)
        self.notes += notes
        self.notes += self.algorithm.notes
        self.interpolators = attach_interpolators(self.plan, table.master.inputs)
        self.notes += recording_notes(self.components, table.components)
        if table.master.inputs != "hold":
            self.notes.append(interpolation_note(self.interpolators, table.master.inputs))
        if layout is not None:
            self._add_balises(layout, plant, receivers, starts[plant])
        if self.network is not None:
            self.packets = self.network.service(self.plan, self.axis.start)
        told = None if progress is None else lambda t: progress(t, self.axis.stop)
        self.master = make_master(self.table, self.plan, self.axis, self.service, told, self.algorithm, self.packets)
        if self.master.system.events is not None:
            self.notes += self.master.system.events.notes
        self.notes += self.master.stepper.notes
        if self.packets is not None and self.master.stepper.compiled is not None:
            self.notes.append(
                "Packets are sent and delivered by Python: the compiled stepper halts at points with one, "
                "and leaves steps with one inside to it."
            )
        self._begin_stream(self.master)
        self.setup_seconds = perf_counter() - begin

    def _load_components(self) -> None:
        """The components, with what their descriptions give reason to doubt."""
        table, span = self.table, (self.table.start, self.table.stop)
        self.factories, notes = component_factories(
            table.components, self.folder, self.where, self._tell_of_builds, span, table.tolerance
        )
        self.notes += notes
        files = {name: (self.folder / t.fmu).resolve() for name, t in table.components.items() if t.fmu is not None}
        check_instances(files, self.where)
        for name, factory in self.factories.items():
            self.components[name] = factory()
            self.components[name].configure(table.components[name].parameters)
            warning = tool_warning(name, self.components[name].description)
            if warning is not None:
                self._warn(warning)
            doubled = doubled_names(self.components[name].description)
            if doubled is not None and not any(doubled in told for told in self.warnings):
                self._warn(f"{name}: {doubled}")

    def execute(self, interruption: Interruption) -> Outcome:
        """Run the master and gather what came out."""
        assert self.plan is not None
        assert self.master is not None
        master = self.master
        failure: str | None = None
        surroundings = SurroundingsOfSteps()

        def between_steps() -> None:
            surroundings.look()
            interruption.check()

        master.between_steps = between_steps
        try:
            master.run()
        except CosimError as error:
            failure = explained_failure(error, self.plan, self._as_recorded())
        except KeyboardInterrupt:
            failure = INTERRUPTED
        changed_in_steps = surroundings.finish()
        if master.ended_early is not None:
            self._warn(master.ended_early)
        recorded = self._as_recorded()  # before a stream is finished: to ask for its rows again would reserve more
        premises, left = premise_findings(recorded, self.table.components, self.connections)
        for warning in (*master.control.warnings(), *left):
            self._warn(warning)
        summary = run_summary(self.name, self.table, self.plan, master, self.setup_seconds)
        events = [] if self.service is None else all_telegrams(self.service)
        spec, (table, signals) = report_spec(self.table), self._in_si()
        for warning in result_warnings(Result(table, signals, failure=failure), spec):
            self._warn(warning)
        for warning in warnings_after(self.components, events, changed_in_steps, recorded):
            self._warn(warning)
        if self.call_log is not None and self.call_log.broken is not None:
            self._warn(self.call_log.broken)
        found, beyond = balise_summary(self.choice, self.service, self.certificates, self.axis.start, events)
        for warning in beyond:
            self._warn(warning)
        summary |= found
        self.notes += missed_samples(self.components)
        summary |= {"certificates": self.certificates, "premises": premises} | {
            "warnings": self.warnings,
            "notes": self.notes,
        }
        summary |= judged_summary(Result(table, signals, events, failure=failure), spec)
        if interruption.came:
            failure = failure or INTERRUPTED
        messages = in_order(component.messages for component in self.components.values())
        packets = [] if self.packets is None else self.packets.records()
        if self.network is not None:
            summary["network"] = network_summary(self.network, packets, self.axis.start, float(table["time"][-1]))
        result = Result(table, signals, events, summary, failure, messages, packets)
        outcome = Outcome(result, spec, tuple(self.table.report.tables))
        return outcome.with_summary(expectations=[judged.to_data() for judged in judge(self.table, outcome)])

    def close(self) -> None:
        """Free everything, also after a set-up that failed half-way."""
        if self.plan is not None:
            close(self.plan)
        for component in self.components.values():
            component.terminate()
            component.free()
        if self.call_log is not None:
            self.call_log.close()

    def _warn(self, text: str) -> None:
        self.warnings.append(text)
        self._tell(text)

    def _unit(self, name: str) -> Unit | None:
        component, _, signal = name.partition(".")
        if self.network is not None and component == NETWORK:
            return self.network.outputs.unit(signal)
        return self.components[component].unit(signal)

    # -- set-up -----------------------------------------------------------------------------------------------------

    def _connect(self, pairs: Sequence[Link]) -> tuple[list[Connection], list[Connection]]:
        """Connections as they stand in the scenario, and as the plan takes them."""
        self.network = make_network(self.table, self.components, self.folder, self.where)
        if self.network is None:
            connections = connect(pairs, self.components)
            settle_recordings(self.components, connections)
            return connections, connections
        found = connect_over(self.network, self.table, pairs, self.components, self.where)
        settle_recordings(self.components, found[1])
        self.notes += self.network.notes()
        for warning in network_warnings(self.network, self.table, self.components, self.where):
            self._warn(warning)
        return found

    def _with_network(self) -> dict[str, Component]:
        """All that has outputs: the components, and the network where there is one."""
        return self.components if self.network is None else {**self.components, NETWORK: self.network.outputs}

    def _make_plan(
        self, connections: Sequence[Connection], order: Sequence[str], clocks: Sequence[ClockConnection]
    ) -> Plan:
        extra = signals_to_record(self.table)
        if self.network is None:
            return make_plan(self.components, connections, order, extra, clocks)
        for name, signals in self.network.hidden(self.components).items():
            extra[name] += [signal for signal in signals if signal not in extra[name]]
        return make_plan(self._with_network(), connections, order, extra, clocks, self.network.outputs)

    def _instantiate(self, starts: dict[str, dict[str, StartValue]], connections: list[Connection]) -> None:
        for name, component in self.components.items():
            if isinstance(component, FMI3Component):
                moving = followed(self.components, connections)
                every = self.table.master.inputs != "hold"
                own = [c for c in connections if c.target[0] == name and (every or c.source_variable in moving)]
                component.request_intermediate_updates([c.target[1] for c in own])
            component.choose_log(self.table.components[name].log)
            if self.call_log is not None:
                log_calls(component, self.call_log)
            component.instantiate()
            for parameter, value in starts[name].items():
                component.set_start(parameter, value)

    def _start_values(self, name: str, component: Component) -> dict[str, StartValue]:
        table = self.table.components[name]
        if table.filter is not None:
            return {}  # they are those of its FMU, which has taken them
        given = protocol_parameters(table, component, f"components.{name}") | table.parameters
        return start_values(component, given | component_seed(component, table.parameters, self.table.seed))

    def _balise_roles(self) -> tuple[list[str], str]:
        balises = self.table.balises
        if balises is None:
            return [], ""
        plant = watched_plant(balises, self.components, self.where)
        return find_receivers(balises, self.components, plant, self.where), plant

    def _check_certificates(self, layout: Layout | None, receivers: list[str], links: Sequence[Link]) -> None:
        table, of_gaps = self.table, list[str]()
        if table.certificates != "ignore":
            sources = Sources(table, self.components, links, layout, receivers, self.network, self.where)
            self.certificates, of_gaps = check_certificates(
                table.components, sources.gaps(), table.certificates, self.where
            )
        others = deaf_receivers(table.components, receivers, links, self.where)
        others += other_plants(table.components, self.where)
        others += left_working_points(table.components, links, self.where)
        for warning in (*of_gaps, *check_conditions(table.components, table.certificates, self.where), *others):
            self._warn(warning)

    def _add_balises(self, layout: Layout, plant: str, receivers: list[str], starts: dict[str, StartValue]) -> None:
        table = self.table.balises
        assert table is not None
        assert self.plan is not None
        self.choice = choose_method(
            table, self.components[plant], self.factories[plant], starts, self.axis.start, self.axis.step
        )
        for warning in self.choice.warnings:
            self._warn(warning)
        self.notes.append(f"Balises localised by '{self.choice.method}': {self.choice.reason}.")
        for warning in late_telegram_warnings(table, self.components, receivers):
            self._warn(warning)
        self.service = make_service(table, layout, self.plan, plant, receivers, self.choice)

    def _begin_stream(self, master: Master) -> None:
        """From here on what is recorded, told and logged is in the folder as well."""
        if self.streaming is None:
            return
        summary = first_summary(self.name, self.table, master.plan) | {"report": asdict(report_spec(self.table))}
        summary |= {"certificates": self.certificates, "warnings": self.warnings, "notes": self.notes}
        events = [] if self.service is None else self.service.mailbox.log
        logs = [component.messages for component in self.components.values()]
        folder, begun = self.streaming
        packets = None if self.packets is None else self.packets.settled
        self.stream = Stream(folder, master.plan.signals, self._unit, summary, lambda: events, logs, packets)
        master.recorder = make_recorder(self.table, master.plan.signals, 0, self.stream)
        begun()

    # -- after the run ----------------------------------------------------------------------------------------------

    def _as_recorded(self) -> Any:
        """The table in the components' own units."""
        assert self.master is not None
        table = self.master.recorder.table()
        return table if self.stream is None else InFormerUnits(table, self.stream.units)

    def _in_si(self) -> tuple[np.ndarray, list[SignalInfo]]:
        """The table and its columns in SI; that of a stream was written so."""
        assert self.plan is not None
        assert self.master is not None
        table = self.master.recorder.table()
        if self.stream is None:
            return in_si(table, self.plan.signals, self._unit)
        self.stream.finish()
        return table, self.stream.signals
