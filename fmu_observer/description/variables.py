"""The variables of a system's description: signals, events, the event protocol, derivatives. Touches no files."""

from __future__ import annotations

from typing import Literal

from fmpy.model_description import Item, ModelVariable, SimpleType

from fmu_observer.annotated_variable import MARKS, AnnotatedVariable
from fmu_observer.description.variable_table import VariableTable, exposed_inputs, referenced
from fmu_observer.event_protocol import JOURNAL_CAPACITY, LATE_POLICIES, OUTCOME_TEXTS, OUTCOME_VARIABLES, EventProtocol
from plant_models.hybrid import HybridSystem, Signal, TriggeredEvent

FmiVersion = Literal[2, 3]

STAMP_NOW = -1.0e30
"""Start value of ``<event>_time``: the event happened at the time at which it is notified."""

LATE_POLICY_TYPE = "LatePolicy"
DISPLAY_UNITS = {"m/s": "km/h"}
"""Units to show at the user's edge where a signal names none."""


def model_variables(
    system: HybridSystem, fmi_version: FmiVersion, preset: str | None, protocol: EventProtocol
) -> list[ModelVariable]:
    """All variables, in the order of their value references.

    Args:
        system: the hybrid system. fmi_version: 2 or 3.
        preset: whose values become the start values; None for the system's default.
        protocol: how the system is notified of triggered events.
    """
    table = VariableTable.of(system)
    real = "Real" if fmi_version == 2 else "Float64"
    starts = _start_values(system, preset)
    time = _variable("time", table.time, real, "independent", "continuous", unit="s", description="Simulation time")
    variables = [time]
    for first, signals in (
        (table.inputs, exposed_inputs(system)),
        (table.outputs, system.outputs),
        (table.states, system.states),
        (table.parameters, system.parameter_signals),
    ):
        names = ((signal, name) for signal in signals for name in signal.scalar_names)
        variables += [_signal_variable(s, name, first + i, real, starts) for i, (s, name) in enumerate(names)]
    for i, event in enumerate(system.triggered_events):
        variables += _event_variables(event, table.events + 2 * i, fmi_version, protocol.counts(fmi_version))
    if system.triggered_events:
        variables += _protocol_variables(protocol, protocol.policy_number(system.late_policy), table.protocol, real)
        variables += _outcome_variables(table.outcomes, "Integer" if fmi_version == 2 else "Int32")
    if not protocol.counts(fmi_version):
        _assign_clocks(system, variables)
    return variables + _rate_variables(system, variables, real)


def _signal_variable(signal: Signal, name: str, reference: int, real: str, starts: dict[str, float]) -> ModelVariable:
    initial = {"output": "calculated", "local": "exact", "parameter": "exact"}.get(signal.causality)
    start = None if signal.causality == "output" else starts[name]
    kind = real if not signal.integer else ("Integer" if real == "Real" else "Int32")
    unit = None if signal.integer else signal.unit
    variable = _variable(
        name, reference, kind, signal.causality, signal.variability, initial, unit, start, signal.description
    )
    variable.displayUnit = signal.display_unit or DISPLAY_UNITS.get(signal.unit)
    variable.min = None if signal.min is None else repr(float(signal.min))
    variable.max = None if signal.max is None else repr(float(signal.max))
    marks = [mark for mark in MARKS if getattr(signal, mark)]
    annotated = signal.warning is not None or marks
    return AnnotatedVariable.of(variable, signal.warning, marks) if annotated else variable


def _event_variables(
    event: TriggeredEvent, reference: int, fmi_version: FmiVersion, counts_events: bool
) -> list[ModelVariable]:
    what = event.description or f"event {event.name}"
    stamp_text = f"Instant of the {event.name}; start value: at the current time"
    real, integer = ("Real", "Integer") if fmi_version == 2 else ("Float64", "Int32")
    if counts_events:
        counter = _variable(
            f"{event.name}_count", reference, integer, "input", "discrete", start=0, description=f"Raise by one: {what}"
        )
    else:
        counter = _variable(event.name, reference, "Clock", "input", "discrete", description=what)
        counter.intervalVariability = "triggered"
    stamp = _variable(f"{event.name}_time", reference + 1, real, "input", "discrete", None, "s", STAMP_NOW, stamp_text)
    return [counter, stamp]


def _protocol_variables(protocol: EventProtocol, number: int, reference: int, real: str) -> list[ModelVariable]:
    text = "What to do with an event stamped before the current time"
    policy = _variable("late_policy", reference, "Enumeration", "parameter", "fixed", "exact", None, number, text)
    policy.declaredType = late_policy_type()
    text = f"How far back late events can be replayed, at most {JOURNAL_CAPACITY} records"
    horizon = _variable(
        "replay_horizon", reference + 1, real, "parameter", "fixed", "exact", "s", protocol.replay_horizon, text
    )
    horizon.min = "0.0"
    return [policy, horizon]


def _outcome_variables(reference: int, integer: str) -> list[ModelVariable]:
    named = enumerate(OUTCOME_VARIABLES.items())
    kind = ("local", "discrete", "calculated", None, None)
    return [_variable(name, reference + i, integer, *kind, OUTCOME_TEXTS[outcome]) for i, (name, outcome) in named]


def _rate_variables(system: HybridSystem, variables: list[ModelVariable], real: str) -> list[ModelVariable]:
    """Derivatives of the continuous states, then the event indicators of dry friction and of switching functions."""
    table = VariableTable.of(system)
    states = referenced(variables, table.states, system.continuous_count)
    rates = []
    for i, state in enumerate(states):
        unit, text = _per_second(state.unit or "1"), f"Derivative of {state.name}"
        rate = _variable(
            f"der({state.name})", table.derivatives + i, real, "local", "continuous", "calculated", unit, None, text
        )
        rate.derivative, state.reinit = state, bool(system.events or system.frictions)
        rates.append(rate)
    texts = {name: f"Changes its sign when {name} comes to rest or breaks away" for name in system.frictions}
    texts |= {name: f"Changes its sign where {name} is passed" for name in system.switchings}
    for i, (name, text) in enumerate(texts.items()):
        kind = ("local", "continuous", "calculated", None, None, text)
        rates.append(_variable(f"event_indicator.{name}", table.indicators + i, real, *kind))
    return rates


def _per_second(unit: str) -> str:
    return f"{unit}2" if unit.endswith("/s") else f"{unit}/s"


def _assign_clocks(system: HybridSystem, variables: list[ModelVariable]) -> None:
    by_name = {v.name: v for v in variables}
    for event in system.triggered_events:
        clock = by_name[event.name].valueReference
        payload = [name for signal in event.payload for name in signal.scalar_names]
        for name in [*payload, f"{event.name}_time"]:
            by_name[name].clocks = [clock]


def _variable(
    name: str,
    reference: int,
    kind: str,
    causality: str,
    variability: str,
    initial: str | None = None,
    unit: str | None = None,
    start: float | None = None,
    description: str = "",
) -> ModelVariable:
    python_type: type = {"Integer": int, "Int32": int, "Enumeration": int, "Clock": bool}.get(kind, float)
    return ModelVariable(
        name=name,
        valueReference=reference,
        type=kind,
        python_type=python_type,
        causality=causality,
        variability=variability,
        initial=initial,
        unit=None if unit == "1" else unit,
        start=None if start is None else repr(python_type(start)),  # a NumPy scalar would give its type's name
        description=description or None,
    )


def _start_values(system: HybridSystem, preset: str | None) -> dict[str, float]:
    signals = (*exposed_inputs(system), *system.states, *system.parameter_signals)
    starts = {name: value for s in signals for name, value in zip(s.scalar_names, s.start_values, strict=True)}
    return starts | system.preset_values(preset)


def late_policy_type() -> SimpleType:
    """The enumeration of what is done with late events."""
    texts = {
        "replay": "Back to the stamp, jump, forward again",
        "reject": "No effect but a warning",
        "late": "Jump when notified; for comparison only",
    }
    items = [Item(name=name, value=str(i + 1), description=texts[name]) for i, name in enumerate(LATE_POLICIES)]
    return SimpleType(
        name=LATE_POLICY_TYPE, type="Enumeration", description="What to do with a late event", items=items
    )
