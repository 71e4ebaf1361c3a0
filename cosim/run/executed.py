"""From a run that is ready to its outcome: stepped to its end or first failure, evaluated, summed up, with what to
warn of.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from itertools import pairwise
from math import isfinite
from typing import Any

import numpy as np

from cosim.balises.localiser import SHORTEST_PART
from cosim.components.component import Component
from cosim.coupling.connection import Connection
from cosim.diagnostics.call_log import CallLog
from cosim.diagnostics.messages import FAULTS, OF_THE_RUN, in_order
from cosim.errors import CosimError
from cosim.evaluation.result_warnings import result_warnings
from cosim.evaluation.spec import ReportSpec
from cosim.expectations.evaluate import evaluate
from cosim.process.interruption import Interruption
from cosim.results.declared_units import in_si_only
from cosim.results.result import BaliseRecord, Result
from cosim.results.si import InFormerUnits, in_si
from cosim.run.network_remarks import network_summary, packet_gaps
from cosim.run.observer_findings import GapSeen, findings_after
from cosim.run.outcome import INTERRUPTED, Outcome
from cosim.run.premises import premise_findings
from cosim.run.ready import Ready
from cosim.run.remarks import Remarks
from cosim.run.services import Services
from cosim.run.signal_roles import report_spec
from cosim.run.summary import evaluated_summary, run_summary
from cosim.run.values_not_taken import values_not_taken
from cosim.structure.divergence import explained_failure
from fmu_observer.annotated_variable import declared_warnings
from fmus.exchange.slave import solver_of
from fmus.fmi.surroundings import SurroundingsOfSteps, is_left
from plant_models.hybrid.missing import MISSED_SAMPLES
from plant_models.hybrid.signal import OutputWarning

_DOUBTS = {"doubted": "used", "ignored": "ignored"}  # what became of a telegram that was doubted, by its outcome
_NAMED_DOUBTS = 5


def _all_telegrams(services: Services) -> list[BaliseRecord]:
    """Everything that was passed: delivered, missed, and still on its way at the end."""
    if services.balises is None:
        return []
    mailbox = services.balises.mailbox
    waiting = [replace(e, outcomes=dict.fromkeys(_receivers(services), "undelivered")) for e in mailbox.waiting]
    return [*mailbox.log, *waiting]


def _largest_gap(services: Services, start: float, telegrams: Sequence[BaliseRecord]) -> float | None:
    """The longest time without a balise [s]; None where none was passed, and without balises.

    Args:
        services: of the run. start: of the run [s]. telegrams: of the run.
    """
    if services.balises is None:
        return None
    stamps = sorted(telegram.stamp for telegram in telegrams if telegram.kind == "true")
    return max((b - a for a, b in pairwise([start, *stamps])), default=None)


def _balise_summary(services: Services, gap: float | None) -> dict[str, Any]:
    """Method, probe and gap, for the summary of a run.

    Args:
        services: of the run. gap: the longest between balises [s], None for none.
    """
    choice, service = services.choice, services.balises
    if choice is None or service is None:
        nothing = dict.fromkeys(("localisation", "probe", "redo_differences", "largest_gap"))
        return {**nothing, "undelivered": 0}
    return {
        "localisation": choice.to_dict(),
        "probe": None if choice.probe is None else choice.probe.to_dict(),
        "redo_differences": service.localiser.watch.redo_differences,
        "largest_gap": gap,
        "undelivered": len(service.mailbox.waiting),
    }


def _receivers(services: Services) -> list[str]:
    return [] if services.balises is None else [r.planned.component.name for r in services.balises.receivers]


def _warnings_after(
    components: Mapping[str, Component],
    telegrams: Sequence[BaliseRecord],
    changed_in_steps: Set[str],
    table: np.ndarray,
) -> Iterator[str]:
    """Texts that warn of what happened on the way."""
    for name, component in components.items():
        for signal, warning in declared_warnings(component.description).items():
            yield from _declared(table, name, signal, warning)
    yield from _trespasses(components, changed_in_steps)
    for name, component in components.items():
        rejected = (component.outcomes() or {}).get("rejected", 0)
        if rejected:
            yield f"{name}: {rejected} telegrams were rejected: stamped in the past, and beyond what it replays."
    doubted = [telegram for telegram in telegrams if not _DOUBTS.keys().isdisjoint(telegram.outcomes.values())]
    for name in components:
        yield from _doubted(name, doubted)
    for name, component in components.items():
        if component.call_warnings:
            yield f"{name} returned the status warning, and the run went on: {component.call_warnings}."
        if component.contradictions:
            yield f"{name} said in doStep what it must not, and the run went on: {component.contradictions}."
    for name, component in components.items():
        wrong = {status: count for status, count in component.messages.counts.items() if status in FAULTS}
        if wrong:
            counts = ", ".join(f"{count} of status {status}" for status, count in wrong.items())
            yield f"{name} logged {counts}; the last says: {component.messages.reason}"


def _hidden_passings(services: Services) -> Iterator[str]:
    """Where a train may have passed a balise there and back within a step that is only known at its ends."""
    service = services.balises
    if service is not None and isfinite(service.localiser.hidden_from):
        yield (
            f"balises: in a step from t = {service.localiser.hidden_from:g} s on {service.plant} could pass a balise "
            f"and come back, which '{service.localiser.method}' does not find: it only knows both ends of a step. Take "
            f"steps of at most {SHORTEST_PART:g} s."
        )


def _missed_samples(components: Mapping[str, Component]) -> Iterator[str]:
    """Notes of the measurements that were missing, one a component that left some out."""
    for name, component in components.items():
        count = component.missed_samples().get(MISSED_SAMPLES, 0)
        if count:
            yield f"{name}: {count} measurements were missing at its samples, and left out."


def _gone_round(components: Mapping[str, Component]) -> Iterator[str]:
    """Notes of what components refused, and of directional derivatives that a solver did not use."""
    for name, component in components.items():
        for message in component.messages.kept():
            if message.text.startswith(OF_THE_RUN):
                yield f"{name}: {message.text.removeprefix(OF_THE_RUN)}."
        solver = solver_of(component.slave)
        if solver is not None and solver.motion is not None and solver.motion.told:
            yield f"{name}: the solver takes {solver.motion.jacobian}."


def _declared(table: np.ndarray, name: str, signal: str, warning: OutputWarning) -> Iterator[str]:
    """What an output warns of: what it never reached, or the first row that is not zero and the values there."""
    column, fields = f"{name}.{signal}", table.dtype.names or ()
    if column not in fields or not len(table):
        return
    values = np.asarray(table[column], dtype=float)
    if warning.reaches is not None:
        if np.nanmax(values, initial=-np.inf) < warning.reaches:
            yield f"{name}: {warning.text}; {signal} came to {np.nanmax(values):.6g} of {warning.reaches:.6g}."
        return
    raised = np.flatnonzero(values != 0.0)
    if warning.at_end:
        raised = raised[raised == len(values) - 1]
    if not len(raised):
        return
    time, first = np.asarray(table["time"], dtype=float), raised[0]
    shown = [other for other in warning.shows if f"{name}.{other}" in fields]
    others = ", ".join(f"{other} = {float(table[f'{name}.{other}'][first]):.6g}" for other in shown)
    beside = f" ({others})" if others else ""
    if warning.at_end:
        yield f"{name}: {warning.text}; seen at the end, {time[-1]:.6g} s{beside}."
        return
    seconds = float(np.diff(time)[values[:-1] != 0.0].sum())
    yield f"{name}: {warning.text}; first at {time[first]:.6g} s{beside}, for {seconds:.3g} s in all."


def _trespasses(components: Mapping[str, Component], in_steps: Set[str]) -> Iterator[str]:
    """What was changed for everybody in this process, and put back."""
    for name, component in components.items():
        for changed, call in component.trespasses.items():
            then = "that was left so" if is_left(changed) else "it was put back"
            yield f"{name}: {call} changed {changed} of the whole program; {then}."
    native = [name for name, component in components.items() if component.kind == "FMU"]
    for changed in sorted(in_steps):
        then = "that was left so" if is_left(changed) else "it was put back, but not after every step"
        yield (
            f"{' or '.join(native)}: its steps change {changed} of the whole program; {then}: other components, and "
            "their numbers, may have been touched."
        )


def _doubted(name: str, telegrams: Sequence[BaliseRecord]) -> Iterator[str]:
    """Which telegrams an observer did not believe."""
    parts, count = [], 0
    for outcome, what in _DOUBTS.items():
        found = [e for e in telegrams if e.outcomes.get(name) == outcome]
        if found:
            first = ", ".join(f"{e.stamp:.6g} s" for e in found[:_NAMED_DOUBTS])
            more = ", ..." if len(found) > _NAMED_DOUBTS else ""
            parts.append(f"{len(found)} {what} (stamped {first}{more})")
            count += len(found)
    if parts:
        plural = "telegram" if count == 1 else "telegrams"
        yield f"{name} doubted {count} {plural}: {', '.join(parts)}; see docs/theses/telegram_gate.md."


@dataclass(frozen=True)
class _Executed:
    """What stepping left.

    Args:
        failure: why the run ended early, or None. changed: what FMUs changed in steps for the whole program.
    """

    failure: str | None
    changed: frozenset[str]


def execute(
    ready: Ready, setup_seconds: float, call_log: CallLog | None, interruption: Interruption, remarks: Remarks
) -> Outcome:
    """Run the master and gather what came out.

    Args:
        ready: the run. setup_seconds: wall time of the set-up [s]. call_log: where calls are logged; None for nowhere.
        interruption: that may end it early. remarks: of the run.
    """
    executed = _step(ready, interruption, remarks)
    if executed.failure is None:
        remarks.warn(*(text for text in values_not_taken(ready.coupled, stepped=True) if text not in remarks.warnings))
    recorded = _as_recorded(ready)  # before a stream is finished: to ask for its rows again would reserve more
    premises = _remark_model(ready, recorded, remarks)
    summary = run_summary(ready.task, ready.master, setup_seconds)
    telegrams, spec = _all_telegrams(ready.services), report_spec(ready.task.table)
    result = _in_si(ready, telegrams, executed.failure)
    remarks.warn(*result_warnings(replace(result, events=[]), spec))  # judged by its rows alone
    remarks.warn(*_warnings_after(ready.coupled.components, telegrams, executed.changed, recorded))
    remarks.warn(*_hidden_passings(ready.services))
    if call_log is not None and call_log.broken is not None:
        remarks.warn(call_log.broken)
    summary |= _summary(ready, result, spec, premises, remarks)
    failure = executed.failure or (INTERRUPTED if interruption.came else None)
    messages = in_order(component.messages for component in ready.coupled.components.values())
    result = replace(result, summary=summary, failure=failure, messages=messages)
    outcome = Outcome(result, spec, tuple(ready.task.table.report.tables))
    return outcome.with_summary(expectations=[evaluated.to_data() for evaluated in evaluate(ready.task.table, outcome)])


def _step(ready: Ready, interruption: Interruption, remarks: Remarks) -> _Executed:
    """Run the master to its end or its first failure."""
    failure: str | None = None
    surroundings = SurroundingsOfSteps()

    def between_steps() -> None:
        surroundings.compare()
        interruption.check()

    ready.master.between_steps = between_steps
    ready.master.initialised = lambda: remarks.warn(*values_not_taken(ready.coupled))
    try:
        ready.master.run()
    except CosimError as error:
        failure = explained_failure(error, ready.master.plan, _as_recorded(ready))
        if interruption.came:  # a call that did not return was given up
            remarks.warn(failure)
            failure = INTERRUPTED
    except KeyboardInterrupt:
        failure = INTERRUPTED
    return _Executed(failure, frozenset(surroundings.finish()))


def _remark_model(ready: Ready, recorded: Any, remarks: Remarks) -> dict[str, dict[str, Any]]:
    """Warn of what the master and the models of observers were not made for; how long they were outside."""
    master = ready.master
    if master.ended_early is not None:
        remarks.warn(master.ended_early)
    premises, outside = premise_findings(recorded, ready.task.table.components, ready.coupled.connections)
    remarks.warn(*master.control.warnings(), *outside)
    return premises


def _summary(
    ready: Ready, result: Result, spec: ReportSpec, premises: dict[str, dict[str, Any]], remarks: Remarks
) -> dict[str, Any]:
    """What is known of a run once it is over."""
    start = ready.master.axis.start
    gap = _largest_gap(ready.services, start, result.events)
    gaps = {name: GapSeen(gap, "balises") for name in _receivers(ready.services)}
    if ready.coupled.network is not None:
        gaps = packet_gaps(ready.coupled.network, result.packets, start) | gaps
    gaps |= _counted_gaps(ready.coupled.connections, ready.checked.certificates, result, start)
    certificates, beyond = findings_after(ready.checked.certificates, gaps)
    remarks.warn(*beyond)
    remarks.note(*_missed_samples(ready.coupled.components), *_gone_round(ready.coupled.components))
    found = _balise_summary(ready.services, gap)
    found |= {"certificates": certificates, "premises": premises, "warnings": remarks.warnings, "notes": remarks.notes}
    found |= evaluated_summary(result, spec)
    if ready.coupled.network is not None:
        found["network"] = network_summary(ready.coupled.network, result.packets, start, float(result.time[-1]))
    return found


def _counted_gaps(
    connections: Sequence[Connection], certificates: Mapping[str, dict[str, Any]], result: Result, start: float
) -> dict[str, GapSeen]:
    """The longest time between samples of those that the count of another component triggers, by the rows recorded.

    Args:
        connections: of the scenario. certificates: findings by component. result: of the run. start: of the run [s].
    """
    found, names = dict[str, GapSeen](), set(result)
    for connection in connections:
        (name, target), count = connection.target, ".".join(connection.source)
        event = certificates.get(name, {}).get("event")
        if event is not None and target == f"{event}_count" and count in names:
            instants = result.time[1:][np.diff(result[count]) > 0]
            gap = max((float(b - a) for a, b in pairwise([start, *instants])), default=None)
            found[name] = GapSeen(gap, f"samples of {count}")
    return found


def _as_recorded(ready: Ready) -> Any:
    """The table in the components' own units."""
    table = ready.master.recorder.table()
    return table if ready.stream is None else InFormerUnits(table, ready.stream.units)


def _in_si(ready: Ready, telegrams: list[BaliseRecord], failure: str | None) -> Result:
    """Rows in SI, those of a stream were written so; with telegrams and packets."""
    table = ready.master.recorder.table()
    if ready.stream is None:
        table, signals = in_si(table, ready.master.plan.signals, ready.coupled.unit)
    else:
        ready.stream.finish()
        signals = ready.stream.signals
    if ready.task.table.report.si:
        signals = in_si_only(signals)
    packets = [] if ready.services.packets is None else ready.services.packets.records()
    return Result(table, signals, telegrams, failure=failure, packets=packets)
