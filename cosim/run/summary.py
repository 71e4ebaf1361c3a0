"""The summary of a run: how it was made, what it cost, what to know; plain data for a JSON file."""

from __future__ import annotations

from dataclasses import asdict
from datetime import UTC, datetime
from typing import Any

from cosim.components.component import Component
from cosim.components.start_values import StartValue
from cosim.coupling.plan import Plan
from cosim.diagnostics.call_statistics import CallStatistics
from cosim.evaluation.balise_gaps import gap_errors
from cosim.evaluation.consistency import filter_consistency
from cosim.evaluation.fault_detection import fault_detection
from cosim.evaluation.spec import ReportSpec
from cosim.master.master import Master
from cosim.results.result import Result
from cosim.run.task import RunTask
from cosim.scenario.scenario_tables import ComponentTable
from fmus.exchange.slave import solver_of
from fmus.versions import versions

MESSAGES_SHOWN = 20


def first_summary(task: RunTask, plan: Plan) -> dict[str, Any]:
    """What is known before the first step.

    Args:
        task: of the run. plan: prepared, components instantiated.
    """
    table = task.table
    return {
        "scenario": task.name,
        "title": table.title,
        "description": " ".join(table.description.split()),
        "source": table.source,
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "start": table.start,
        "stop": table.stop,
        "step": table.step,
        "seed": table.seed,
        "order": [s.component.name for s in plan.steps],
        "components": [_component(s.component, table.components[s.component.name]) for s in plan.steps],
        "connections": [str(item) for item in table.connections],
        "versions": versions(),
    }


def run_summary(task: RunTask, master: Master, setup_seconds: float) -> dict[str, Any]:
    """Scenario, times, components, versions.

    Args:
        task: of the run. master: after the run. setup_seconds: wall time of the set-up [s].
    """
    axis, timing, plan = master.axis, master.timing, master.plan
    reached = float(master.recorder.table()["time"][-1]) if master.recorder.count else axis.start
    wall = timing.initialisation + timing.stepping + timing.recording
    in_components = {s.component.name: s.component.seconds_in_all for s in plan.steps}
    rest = max(wall - sum(in_components.values()) - timing.recording, 0.0)  # reading and writing are estimated
    return first_summary(task, plan) | {
        "start": axis.start,
        "stop": axis.stop,
        "reached": reached,
        "step": axis.step,
        "rows": master.recorder.count,
        "setup_seconds": setup_seconds,
        "wall_seconds": wall,
        "real_time_factor": (reached - axis.start) / wall if wall > 0.0 else None,
        "seconds": {**in_components, "master": rest, "recording": timing.recording},
        "exchange_rounds": master.exchange_rounds,
        "master": {
            "algorithm": dict(master.system.algorithm.summary()),
            "control": dict(master.control.summary()),
            "stepper": master.stepper.summary(timing.stepping + timing.recording),
            "events": None if master.system.events is None else master.system.events.summary(),
        },
    }


def _component(component: Component, table: ComponentTable) -> dict[str, Any]:
    outcomes, missed = component.outcomes(), component.missed_samples()
    solver = solver_of(component.slave)
    return ({} if solver is None else {"solver": solver.summary()}) | {
        "name": component.name,
        "kind": component.kind,
        "fmi_version": component.description.fmiVersion,
        "model": component.description.modelName,
        "guid": component.description.guid,
        "preset": table.preset,
        "options": table.options,
        "parameters": {name: _shown(value) for name, value in component.starts.items()},
        "tolerance": component.tolerance,
        "source": component.source,
        "calls": component.calls,
        "seconds": component.seconds,
        "cost": _call_statistics_table(component.calls, component.seconds, component.call_statistics),
        "messages": [message.text for message in component.messages.kept()[-MESSAGES_SHOWN:]],
        "message_counts": dict(component.messages.counts),
        "events": None if outcomes is None and not missed else {**(outcomes or {}), **missed},
    }


def _shown(value: StartValue) -> Any:
    """A start value as JSON takes it: bytes in hexadecimal."""
    if isinstance(value, list):
        return [_shown(entry) for entry in value]
    return value.hex() if isinstance(value, bytes) else value


def evaluated_summary(result: Result, spec: ReportSpec) -> dict[str, Any]:
    """What the report is given, and what it evaluates: faults, position errors at balises, consistency of filters.

    Args:
        result: the run. spec: roles of its signals.
    """
    found: dict[str, Any] = {"report": asdict(spec)}  # so that the folder states which signal plays which role
    if faults := fault_detection(result, spec):
        found["fault_detection"] = [fault.to_data() for fault in faults]
    if (gaps := gap_errors(result, spec)).errors:
        found["balise_gaps"] = gaps.to_data()
    if filters := filter_consistency(result, spec):
        found["consistency"] = [one.to_data() for one in filters]
    return found


def _call_statistics_table(
    steps: int, seconds: float, call_statistics: dict[str, CallStatistics]
) -> dict[str, dict[str, float]]:
    """Calls and seconds by kind, plain data; kinds that never occurred are left out.

    Args:
        steps: calls of doStep. seconds: in them [s]. call_statistics: of all other kinds.
    """
    table: dict[str, dict[str, float]] = {"doStep": {"calls": steps, "seconds": seconds}} if steps else {}
    return table | {kind: {"calls": t.count, "seconds": t.seconds} for kind, t in call_statistics.items() if t.count}
