"""Warnings after a run: what became of telegrams, what components logged and changed for the whole program, what their
outputs warn of. Changes nothing.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Set

import numpy as np

from cosim.components.component import Component
from cosim.diagnostics.messages import FAULTS
from cosim.results.result import BaliseRecord
from fmu_observer.annotated_variable import declared_warnings
from plant_models.hybrid.missing import MISSED_SAMPLES
from plant_models.hybrid.output_warning import OutputWarning

DOUBTS = {"doubted": "used", "ignored": "ignored"}  # what became of a telegram that was doubted, by its outcome
NAMED_DOUBTS = 5


def warnings_after(
    components: Mapping[str, Component],
    telegrams: Sequence[BaliseRecord],
    changed_in_steps: Set[str],
    table: np.ndarray,
) -> Iterator[str]:
    """Texts that warn of what happened on the way.

    Args:
        components: by name. telegrams: everything that was passed. changed_in_steps: what FMUs changed for the whole
            program. table: rows of the run, fields `component.signal`, in the components' own units.
    """
    for name, component in components.items():
        for signal, warning in declared_warnings(component.description).items():
            yield from _declared(table, name, signal, warning)
    yield from _trespasses(components, changed_in_steps)
    for name, component in components.items():
        rejected = (component.outcomes() or {}).get("rejected", 0)
        if rejected:
            yield f"{name}: {rejected} telegrams were rejected: stamped in the past, and beyond what it replays."
    for name in components:
        yield from _doubted(name, telegrams)
    for name, component in components.items():
        wrong = {status: count for status, count in component.messages.counts.items() if status in FAULTS}
        if wrong:
            counts = ", ".join(f"{count} of status {status}" for status, count in wrong.items())
            yield f"{name} logged {counts}; the last says: {component.messages.reason}"


def missed_samples(components: Mapping[str, Component]) -> Iterator[str]:
    """Notes of the measurements that were missing, one a component that left some out.

    Args:
        components: by name.
    """
    for name, component in components.items():
        count = component.missed_samples().get(MISSED_SAMPLES, 0)
        if count:
            yield f"{name}: {count} measurements were missing at its samples, and left out."


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
    told = ", ".join(f"{other} = {float(table[f'{name}.{other}'][first]):.6g}" for other in shown)
    beside = f" ({told})" if told else ""
    if warning.at_end:
        yield f"{name}: {warning.text}; seen at the end, {time[-1]:.6g} s{beside}."
        return
    seconds = float(np.diff(time)[values[:-1] != 0.0].sum())
    yield f"{name}: {warning.text}; first at {time[first]:.6g} s{beside}, for {seconds:.3g} s in all."


def _trespasses(components: Mapping[str, Component], in_steps: Set[str]) -> Iterator[str]:
    """What was changed for everybody in this process, and put back."""
    for name, component in components.items():
        for changed, call in component.trespasses.items():
            yield f"{name}: {call} changed {changed} of the whole program; it was put back."
    native = [name for name, component in components.items() if component.kind == "FMU"]
    for changed in sorted(in_steps):
        yield (
            f"{' or '.join(native)}: its steps change {changed} of the whole program; it was put back, but not after "
            "every step: other components, and their numbers, may have been touched."
        )


def _doubted(name: str, telegrams: Sequence[BaliseRecord]) -> Iterator[str]:
    """Which telegrams an observer did not believe."""
    parts, count = [], 0
    for outcome, what in DOUBTS.items():
        found = [e for e in telegrams if e.outcomes.get(name) == outcome]
        if found:
            first = ", ".join(f"{e.stamp:.6g} s" for e in found[:NAMED_DOUBTS])
            more = ", ..." if len(found) > NAMED_DOUBTS else ""
            parts.append(f"{len(found)} {what} (stamped {first}{more})")
            count += len(found)
    if parts:
        plural = "telegram" if count == 1 else "telegrams"
        yield f"{name} doubted {count} {plural}: {', '.join(parts)}; see docs/telegram_gate.md."
