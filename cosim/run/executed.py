"""From a run that is ready to its outcome: stepped to its end or first failure, judged, summed up."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from cosim.components.surroundings import SurroundingsOfSteps
from cosim.diagnostics.call_log import CallLog
from cosim.diagnostics.messages import in_order
from cosim.errors import CosimError
from cosim.evaluation.result_warnings import result_warnings
from cosim.evaluation.spec import ReportSpec
from cosim.expectations.judge import judge
from cosim.process.interruption import Interruption
from cosim.results.result import Result
from cosim.results.result_data import BaliseRecord
from cosim.results.si import InFormerUnits, in_si
from cosim.run.after_run import missed_samples, warnings_after
from cosim.run.balise_summary import all_telegrams, balise_summary, certificates_after, largest_gap
from cosim.run.network_remarks import network_summary
from cosim.run.outcome import INTERRUPTED, Outcome
from cosim.run.premises import premise_findings
from cosim.run.ready import Ready
from cosim.run.remarks import Remarks
from cosim.run.signal_roles import report_spec
from cosim.run.summary import judged_summary, run_summary
from cosim.structure.divergence import explained_failure


@dataclass(frozen=True)
class Executed:
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
    executed = _step(ready, interruption)
    recorded = _as_recorded(ready)  # before a stream is finished: to ask for its rows again would reserve more
    premises = _remark_model(ready, recorded, remarks)
    summary = run_summary(ready.task, ready.master, setup_seconds)
    telegrams, spec = all_telegrams(ready.services), report_spec(ready.task.table)
    result = _in_si(ready, telegrams, executed.failure)
    remarks.warn(*result_warnings(replace(result, events=[]), spec))  # judged by its rows alone
    remarks.warn(*warnings_after(ready.coupled.components, telegrams, executed.changed, recorded))
    if call_log is not None and call_log.broken is not None:
        remarks.warn(call_log.broken)
    summary |= _summary(ready, result, spec, premises, remarks)
    failure = executed.failure or (INTERRUPTED if interruption.came else None)
    messages = in_order(component.messages for component in ready.coupled.components.values())
    result = replace(result, summary=summary, failure=failure, messages=messages)
    outcome = Outcome(result, spec, tuple(ready.task.table.report.tables))
    return outcome.with_summary(expectations=[judged.to_data() for judged in judge(ready.task.table, outcome)])


def _step(ready: Ready, interruption: Interruption) -> Executed:
    """Run the master to its end or its first failure."""
    failure: str | None = None
    surroundings = SurroundingsOfSteps()

    def between_steps() -> None:
        surroundings.compare()
        interruption.check()

    ready.master.between_steps = between_steps
    try:
        ready.master.run()
    except CosimError as error:
        failure = explained_failure(error, ready.master.plan, _as_recorded(ready))
    except KeyboardInterrupt:
        failure = INTERRUPTED
    return Executed(failure, frozenset(surroundings.finish()))


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
    gap = largest_gap(ready.services, start, result.events)
    certificates, beyond = certificates_after(ready.checked.certificates, ready.services, gap)
    remarks.warn(*beyond)
    remarks.note(*missed_samples(ready.coupled.components))
    found = balise_summary(ready.services, gap)
    found |= {"certificates": certificates, "premises": premises, "warnings": remarks.warnings, "notes": remarks.notes}
    found |= judged_summary(result, spec)
    if ready.coupled.network is not None:
        found["network"] = network_summary(ready.coupled.network, result.packets, start, float(result.time[-1]))
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
    packets = [] if ready.services.packets is None else ready.services.packets.records()
    return Result(table, signals, telegrams, failure=failure, packets=packets)
