"""Running a validated scenario: make the components, couple them, check, step, and gather the result."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from time import perf_counter
from typing import Any

from cosim.balises.layout import Layout
from cosim.balises.service import BaliseService
from cosim.components.component import Component
from cosim.coupling.connection import Connection, connect, unconnected_inputs
from cosim.coupling.graph import execution_order, undeclared
from cosim.coupling.plan import Plan, make_plan
from cosim.errors import CosimError
from cosim.master.axis import TimeAxis
from cosim.master.master import Master, close
from cosim.report.spec import Phase, ReportSpec
from cosim.results.result import BaliseRecord, Result
from cosim.results.si import in_si
from cosim.scenario.balise_service import Choice, choose_method, find_receivers, make_service, watched_plant
from cosim.scenario.certificates import check_certificates, expected_gap
from cosim.scenario.connections import parse_connections
from cosim.scenario.layouts import make_layout
from cosim.scenario.models import component_factory, protocol_parameters
from cosim.scenario.outcome import Outcome
from cosim.scenario.roles import ROLES, check_roles
from cosim.scenario.schema import ScenarioTable, step_count
from cosim.scenario.starts import start_values
from cosim.scenario.summary import run_summary
from plant_models.hybrid.units import Unit

LOG = logging.getLogger("cosim")
Progress = Callable[[float, float], None]
Warn = Callable[[str], None]


def run_scenario(
    table: ScenarioTable, name: str, folder: Path, where: str, progress: Progress | None = None, warn: Warn | None = None
) -> Outcome:
    """Run a scenario to its end or to its first failure.

    Args:
        table: validated scenario. name: its name. folder: start of relative paths. where: place for messages.
        progress: called with the time reached and the end [s].
        warn: told of everything doubtful as soon as it is known, before the run where it can be; by default the log ``cosim``.

    Raises:
        CosimError: the scenario cannot be set up; failures on the way are in the outcome.
    """
    setup = _Setup(table, folder, where, warn or LOG.warning)
    try:
        try:
            setup.prepare()
        except CosimError as error:
            raise error if str(error).startswith(where) else type(error)(f"{where}: {error}") from error
        return setup.execute(name, progress)
    finally:
        setup.close()


class _Setup:
    """The parts of one run while it is put together; thrown away at its end."""

    def __init__(self, table: ScenarioTable, folder: Path, where: str, tell: Warn) -> None:
        self.table, self.folder, self.where = table, folder, where
        self.axis = TimeAxis(table.start, table.step, step_count(table.start, table.stop, table.step))
        self.warnings: list[str] = []
        self._tell = tell
        self.notes: list[str] = []
        self.certificates: dict[str, dict[str, Any]] = {}
        self.factories: dict[str, Callable[[], Component]] = {}
        self.components: dict[str, Component] = {}
        self.plan: Plan | None = None
        self.choice: Choice | None = None
        self.service: BaliseService | None = None
        self.setup_seconds = 0.0

    def prepare(self) -> None:
        """Everything up to the first step, cheap checks first."""
        begin = perf_counter()
        table = self.table
        layout = None if table.balises is None else make_layout(table.balises, table.start, table.stop, self.folder, self.where)
        pairs = parse_connections(table.connections, self.where)
        for name, component in table.components.items():
            self.factories[name] = component_factory(name, component, self.folder, f"{self.where}: components.{name}")
        for name, factory in self.factories.items():
            self.components[name] = factory()
        connections = connect(pairs, self.components)
        receivers, plant = self._balise_roles()
        check_roles(table, self.components, self.where)
        order = execution_order(self.components, connections, self._before(plant, receivers))
        starts = {n: self._start_values(n, c) for n, c in self.components.items()}
        if layout is not None:
            self._check_certificates(layout, receivers)
        self._instantiate(starts)
        self.plan = make_plan(self.components, connections, order, {n: t.record for n, t in table.components.items()})
        self._note_unconnected(connections)
        if layout is not None:
            self._add_balises(layout, plant, receivers, starts[plant])
        self.setup_seconds = perf_counter() - begin

    def execute(self, name: str, progress: Progress | None) -> Outcome:
        """Run the master and gather what came out."""
        assert self.plan is not None
        stop = self.axis.stop
        master = Master(self.plan, self.axis, self.service, None if progress is None else lambda t: progress(t, stop))
        failure = None
        try:
            master.run()
        except CosimError as error:
            failure = str(error)
        except KeyboardInterrupt:
            failure = "The run was interrupted; what was computed so far is kept."
        if master.ended_early is not None:
            self._warn(master.ended_early)
        summary = run_summary(name, self.table, self.plan, master, self.setup_seconds)
        events = [] if self.service is None else self._all_telegrams(self.service)
        self._warn_of_rejections()
        summary |= self._balise_summary([e.stamp for e in events if e.kind == "true"])
        summary |= {"certificates": self.certificates, "warnings": self.warnings, "notes": self.notes}
        table, signals = in_si(master.recorder.table(), self.plan.signals, self._unit)
        return Outcome(Result(table, signals, events, summary, failure), self._report_spec())

    def close(self) -> None:
        """Free everything, also after a set-up that failed half-way."""
        if self.plan is not None:
            close(self.plan)
        for component in self.components.values():
            component.terminate()
            component.free()

    def _warn(self, text: str) -> None:
        self.warnings.append(text)
        self._tell(text)

    def _unit(self, name: str) -> Unit | None:
        component, _, signal = name.partition(".")
        return self.components[component].unit(signal)

    # -- set-up -----------------------------------------------------------------------------------------------------

    def _instantiate(self, starts: dict[str, dict[str, float]]) -> None:
        for name, component in self.components.items():
            component.instantiate()
            for parameter, value in starts[name].items():
                component.set_start(parameter, value)

    def _start_values(self, name: str, component: Component) -> dict[str, float]:
        table = self.table.components[name]
        return start_values(component, protocol_parameters(table, component, f"components.{name}") | table.parameters)

    def _balise_roles(self) -> tuple[list[str], str]:
        balises = self.table.balises
        if balises is None:
            return [], ""
        plant = watched_plant(balises, self.components, self.where)
        return find_receivers(balises, self.components, plant, self.where), plant

    def _before(self, plant: str, receivers: list[str]) -> list[tuple[str, str]]:
        """What must be stepped before the receivers: the plant, and the odometer whose reading the telegrams carry."""
        balises = self.table.balises
        sources = {plant} if balises is None or balises.odometer is None else {plant, balises.odometer.partition(".")[0]}
        return [(source, name) for source in sorted(sources) for name in receivers if source != name]

    def _check_certificates(self, layout: Layout, receivers: list[str]) -> None:
        assert self.table.balises is not None
        gap = expected_gap(layout, self.table.balises, self.table.start)
        tables = {n: self.table.components[n] for n in receivers}
        self.certificates, warnings = check_certificates(tables, gap, self.table.certificates, self.where)
        for warning in warnings:
            self._warn(warning)

    def _add_balises(self, layout: Layout, plant: str, receivers: list[str], starts: dict[str, float]) -> None:
        table = self.table.balises
        assert table is not None
        assert self.plan is not None
        self.choice = choose_method(table, self.components[plant], self.factories[plant], starts, self.axis.start, self.axis.step)
        for warning in self.choice.warnings:
            self._warn(warning)
        self.notes.append(f"Balises localised by '{self.choice.method}': {self.choice.reason}.")
        self._note_late_telegrams(receivers)
        self.service = make_service(table, layout, self.plan, plant, receivers, self.choice.method)

    def _note_late_telegrams(self, receivers: list[str]) -> None:
        """A block replays what arrives late, and so does an FMU with the parameter `late_policy`; another one may not."""
        table = self.table.balises
        assert table is not None
        sealed = [n for n in receivers if self.components[n].kind == "FMU" and "late_policy" not in self.components[n].variables]
        if sealed and table.latency + table.latency_jitter > 0.0:
            delay = table.latency + table.latency_jitter
            self._warn(
                f"Telegrams arrive up to {delay:g} s late; {', '.join(sealed)}: a sealed FMU without a parameter "
                "late_policy does not say what it does with late stamps."
            )

    def _note_unconnected(self, connections: list[Connection]) -> None:
        free = unconnected_inputs(connections, self.components.values())
        if free:
            self._warn(f"Unconnected inputs keep their start values: {', '.join(free)}.")
        silent = undeclared(self.components.values())
        if silent:
            self.notes.append(f"Declare no dependencies, direct feedthrough assumed absent: {', '.join(silent)}.")

    # -- after the run ----------------------------------------------------------------------------------------------

    def _all_telegrams(self, service: BaliseService) -> list[BaliseRecord]:
        """Everything that was passed: told, missed, and still on its way at the end."""
        names = [r.planned.component.name for r in service.receivers]
        waiting = [replace(e, outcomes=dict.fromkeys(names, "undelivered")) for e in service.mailbox.waiting]
        return [*service.mailbox.log, *waiting]

    def _warn_of_rejections(self) -> None:
        for name, component in self.components.items():
            rejected = (component.outcomes() or {}).get("rejected", 0)
            if rejected:
                self._warn(f"{name}: {rejected} telegrams were rejected: stamped in the past, and beyond what it replays.")

    def _balise_summary(self, stamps: list[float]) -> dict[str, Any]:
        """Method, probe, and the gaps that really occurred against what is certified."""
        if self.choice is None or self.service is None:
            return {"localisation": None, "probe": None, "redo_differences": None, "largest_gap": None, "undelivered": 0}
        gap = max((b - a for a, b in pairwise([self.axis.start, *sorted(stamps)])), default=0.0)
        for name, certificate in self.certificates.items():
            limit = certificate["aperiodic_limit"]
            certificate["largest_gap_seen"] = gap
            if limit is not None and gap > limit and certificate["holds"] is not False:
                self._warn(f"{name}: the longest gap between balises was {gap:.3g} s, certified are {limit:.3g} s.")
        return {
            "localisation": {"method": self.choice.method, "reason": self.choice.reason},
            "probe": None if self.choice.probe is None else self.choice.probe.to_dict(),
            "redo_differences": self.service.localiser.watch.redo_differences,
            "largest_gap": gap,
            "undelivered": len(self.service.mailbox.waiting),
        }

    def _report_spec(self) -> ReportSpec:
        table = self.table.report
        observers = table.observers
        if observers is None:
            observers = [n for n, t in self.table.components.items() if t.observer is not None]
        return ReportSpec(
            title=self.table.title,
            **{role: getattr(table, role) for role in ROLES},
            observers=observers,
            labels={n: t.label for n, t in self.table.components.items() if t.label is not None},
            phases=[Phase(p.name, p.start, p.end) for p in table.phases],
            zones=table.zones,
            evaluate_after=table.evaluate_after,
            published=table.published,
            independent=table.independent,
            notes=table.notes,
        )
