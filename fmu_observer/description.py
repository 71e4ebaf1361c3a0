"""Descriptions: a hybrid system as an fmpy `ModelDescription`.

One description serves the Python block and the exported FMU, so that names, value references, starts, units and
dependencies cannot drift apart. Uses fmpy's data classes and the hybrid system; touches no files.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeVar

import numpy as np
from fmpy.model_description import (
    BaseUnit,
    Category,
    CoSimulation,
    DefaultExperiment,
    DisplayUnit,
    Item,
    ModelDescription,
    ModelExchange,
    ModelVariable,
    SimpleType,
    Unit,
    Unknown,
)

from fmu_observer.annotated_variable import AnnotatedVariable
from fmu_observer.event_protocol import JOURNAL_CAPACITY, LATE_POLICIES, OUTCOME_TEXTS, OUTCOME_VARIABLES, EventProtocol
from plant_models import hybrid
from plant_models.disk_cache.entries import remembered
from plant_models.disk_cache.identity import identity
from plant_models.hybrid import HybridSystem, Signal, TriggeredEvent, width
from plant_models.hybrid.units import BASE_SYMBOLS, conversion, parse_unit

FmiVersion = Literal[2, 3]
ItemOfTable = TypeVar("ItemOfTable")

STAMP_NOW = -1.0e30
"""Start value of ``<event>_time``: the event happened at the time at which it is told."""

LOG_CATEGORIES = {
    "logStatusError": "Calls that were refused, and why",
    "logStatusDiscard": "Steps that could not be done and were undone",
    "logStatusWarning": "Events that came too late or were lost",
    "logEvents": "Events that were applied",
}

FIRST_REFERENCE = 1
"""Value references count from here in the order of the variables: each is the index of its variable as well, as FMI 2
counts.

OMSimulator takes the dependencies of FMI 3, which are value references, for such indices, and does not load an FMU
whose references are none.
"""

VERSION_STRINGS = {2: "2.0", 3: "3.0"}
LATE_POLICY_TYPE = "LatePolicy"
DISPLAY_UNITS = {"m/s": "km/h"}
"""Units to show at the user's edge where a signal names none."""

TOKEN_ATTRIBUTES = (
    "name",
    "valueReference",
    "type",
    "causality",
    "variability",
    "initial",
    "start",
    "min",
    "max",
    "unit",
    "displayUnit",
)


@dataclass(frozen=True)
class VariableTable:
    """Value references of a system: time, then contiguous blocks in this order.

    Args:
        time: value reference of the independent variable.
        inputs: first value reference of inputs and payloads (noise is not exposed).
        outputs: first of the outputs. states: first of the states. parameters: first of the parameters.
        events: first of the event variables, two for each triggered event (clock or count, then stamp).
        protocol: first of `late_policy` and `replay_horizon`; both are missing where there is no triggered event.
        outcomes: first of the counts of what became of events, see `OUTCOME_VARIABLES`; missing there too.
        derivatives: first of the derivatives of the continuous states.
        indicators: first of the event indicators: one for each state with dry friction, then one for each switching
            function.
        end: first value reference that is not used.
    """

    time: int
    inputs: int
    outputs: int
    states: int
    parameters: int
    events: int
    protocol: int
    outcomes: int
    derivatives: int
    indicators: int
    end: int

    @classmethod
    def of(cls, system: HybridSystem) -> VariableTable:
        """The table of a system, the same for FMI 2 and FMI 3."""
        triggered = len(system.triggered_events)
        counts = [
            1,
            width(exposed_inputs(system)),
            width(system.outputs),
            system.state_count,
            width(system.parameter_signals),
        ]
        counts += [2 * triggered, *((2, len(OUTCOME_VARIABLES)) if triggered else (0, 0))]
        counts += [system.continuous_count, len(system.frictions) + len(system.switchings)]
        return cls(*(FIRST_REFERENCE + sum(counts[:i]) for i in range(len(counts) + 1)))


def referenced(items: Sequence[ItemOfTable], first: int, count: int = 1) -> Sequence[ItemOfTable]:
    """Those that have `count` value references from `first` on, of what stands in the order of the variables.

    Args:
        items: in the order of the variables.
    """
    return items[first - FIRST_REFERENCE : first - FIRST_REFERENCE + count]


def exposed_inputs(system: HybridSystem) -> tuple[Signal, ...]:
    """Inputs and event payloads, without the noises that the runtime draws itself.

    Args:
        system: the hybrid system.
    """
    return system.input_signals[: len(system.input_signals) - len(system.noises)]


def describe(
    system: HybridSystem,
    fmi_version: FmiVersion,
    *,
    preset: str | None = None,
    model_name: str | None = None,
    protocol: EventProtocol | None = None,
    model_exchange: bool = False,
) -> ModelDescription:
    """The model description of a system as a co-simulation FMU.

    Args:
        system: the hybrid system.
        fmi_version: 2 or 3.
        preset: preset whose values become the start values; None for the system's default.
        model_name: name to show; None for the system's own.
        protocol: how it is told of triggered events; by default as is usual in the FMI version.
        model_exchange: whether it is a model exchange FMU as well; only a traceable system without communication events
            can be.

    Raises:
        ValueError: the preset or the version of FMI is unknown, or the protocol is none of this version.
    """
    if fmi_version not in VERSION_STRINGS:
        raise ValueError(f"{system.name}: FMI version {fmi_version!r} is unknown; use 2 or 3.")
    protocol = protocol or EventProtocol()
    variables = _variables(system, fmi_version, preset, protocol)
    # text, as fmpy reads it from a file
    experiment = DefaultExperiment(startTime="0.0", stopTime="10.0", stepSize="0.01")
    description = ModelDescription(
        fmiVersion=VERSION_STRINGS[fmi_version],
        modelName=model_name or system.name,
        description=" ".join(system.description.split()),
        generationTool="fmu-observer",
        variableNamingConvention="structured",
        coSimulation=_co_simulation(system, protocol.counts(fmi_version)),
        modelExchange=_model_exchange(system) if model_exchange else None,
        typeDefinitions=[_late_policy_type()] if system.triggered_events else [],
        defaultExperiment=experiment,
        logCategories=[Category(name=name, description=text) for name, text in LOG_CATEGORIES.items()],
        unitDefinitions=_unit_definitions(variables),
        modelVariables=variables,
    )
    table = VariableTable.of(system)
    facts = _facts(system)
    outputs = _unknowns(variables, table.outputs, facts["output"])
    derivatives = _unknowns(variables, table.derivatives, facts["derivative"])
    # A master that is told nothing of these takes each to depend on every input, and sees algebraic loops where there
    # are none.
    description.initialUnknowns = [*outputs, *derivatives]
    description.outputs, description.derivatives = (
        [_running(system, u) for u in group] for group in (outputs, derivatives)
    )
    indicators = referenced(variables, table.indicators, len(system.frictions) + len(system.switchings))
    description.eventIndicators = [Unknown(index=v.valueReference, variable=v) for v in indicators]
    description.numberOfContinuousStates, description.numberOfEventIndicators = system.continuous_count, len(indicators)
    description.instantiationToken = _token(system, description, facts["equations"])
    return description


def can_exchange(system: HybridSystem) -> bool:
    """Whether a system can be a model exchange FMU: its equations can be traced, and no master's steps are part of
    them.
    """
    return system.traceable and not system.communication_events


def _model_exchange(system: HybridSystem) -> ModelExchange:
    if not can_exchange(system):
        raise ValueError(
            f"{system.name}: a system with communication events, or one that cannot be traced, has no model exchange."
        )
    return ModelExchange(
        modelIdentifier=system.name,
        canGetAndSetFMUstate=True,
        canSerializeFMUstate=True,
        providesDirectionalDerivative=True,
        completedIntegratorStepNotNeeded=True,
    )


def _late_policy_type() -> SimpleType:
    texts = {
        "replay": "Back to the stamp, jump, forward again",
        "reject": "No effect but a warning",
        "late": "Jump when told; for comparison only",
    }
    items = [Item(name=name, value=str(i + 1), description=texts[name]) for i, name in enumerate(LATE_POLICIES)]
    return SimpleType(
        name=LATE_POLICY_TYPE, type="Enumeration", description="What to do with a late event", items=items
    )


def _co_simulation(system: HybridSystem, counts_events: bool) -> CoSimulation:
    return CoSimulation(
        modelIdentifier=system.name,
        canHandleVariableCommunicationStepSize=True,
        canGetAndSetFMUstate=True,
        canSerializeFMUstate=True,
        providesDirectionalDerivative=system.traceable,
        hasEventMode=bool(system.triggered_events) and not counts_events,
        mightReturnEarlyFromDoStep=bool(system.periodic_events),
    )


def _variables(
    system: HybridSystem, fmi_version: FmiVersion, preset: str | None, protocol: EventProtocol
) -> list[ModelVariable]:
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
    annotated = signal.warning is not None or signal.optional
    return AnnotatedVariable.of(variable, signal.warning, signal.optional) if annotated else variable


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
    policy.declaredType = _late_policy_type()
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


def _unit_definitions(variables: Iterable[ModelVariable]) -> list[Unit]:
    displayed: dict[str, set[str]] = {}
    for variable in variables:
        if variable.unit is not None:
            displayed.setdefault(variable.unit, set())
            if variable.displayUnit is not None:
                displayed[variable.unit].add(variable.displayUnit)
    return [_unit_definition(name, sorted(shown)) for name, shown in sorted(displayed.items())]


def _unit_definition(name: str, shown: list[str]) -> Unit:
    unit = parse_unit(name)
    powers = dict(zip(BASE_SYMBOLS, unit.exponents, strict=True))
    base = BaseUnit(**powers, factor=unit.factor, offset=unit.offset)
    display = []
    for display_name in shown:
        factor, offset = conversion(unit, parse_unit(display_name))
        display.append(DisplayUnit(name=display_name, factor=factor, offset=offset))
    return Unit(name=name, baseUnit=base, displayUnits=display)


def _unknowns(variables: list[ModelVariable], first: int, dependencies: list[list[int]]) -> list[Unknown]:
    """Outputs or derivatives at initialisation: each with the time, inputs, start values and parameters that it depends
    on.
    """
    unknowns = []
    for variable, references in zip(referenced(variables, first, len(dependencies)), dependencies, strict=True):
        known = [known for reference in references for known in referenced(variables, reference)]
        unknowns.append(_unknown(variable, known))
    return unknowns


def _running(system: HybridSystem, unknown: Unknown) -> Unknown:
    """The same once time runs: what it depends on among time, inputs and continuous states."""
    table = VariableTable.of(system)
    last = table.states + system.continuous_count
    known = (
        v for v in unknown.dependencies if v.valueReference < table.outputs or table.states <= v.valueReference < last
    )
    return _unknown(unknown.variable, list(known))


def _unknown(variable: ModelVariable, known: list[ModelVariable]) -> Unknown:
    kinds = ["dependent"] * len(known)
    return Unknown(index=variable.valueReference, variable=variable, dependencies=known, dependenciesKind=kinds)


def _facts(system: HybridSystem) -> dict[str, Any]:
    """What only the traced equations tell, remembered: ``output`` and ``derivative``, the value references that each
    row depends on, all of them where it cannot be traced; ``equations``, their digest, or the class.
    """
    return dict(remembered("description", identity(system, code=("fmu_observer",)), lambda: _traced_facts(system)))


def _traced_facts(system: HybridSystem) -> dict[str, Any]:
    return {
        "output": _traced_dependencies(system, "output", width(system.outputs)),
        "derivative": _traced_dependencies(system, "derivative", system.continuous_count),
        "equations": hybrid.traced_once(system).digest() if system.traceable else type(system).__qualname__,
    }


def _traced_dependencies(system: HybridSystem, function: str, count: int) -> list[list[int]]:
    table = VariableTable.of(system)
    inputs, parameters = width(exposed_inputs(system)), width(system.parameter_signals)
    groups = (
        ("t", table.time, 1),
        ("u", table.inputs, inputs),
        ("x", table.states, system.state_count),
        ("p", table.parameters, parameters),
    )
    rows: list[list[int]] = [[] for _ in range(count)]
    traced = hybrid.traced_once(system) if system.traceable and count else None
    for group, first, width_ in groups:
        pattern = np.ones((count, width_), dtype=bool)
        if traced is not None and width_:
            pattern = traced.dependencies(function, group)[:, :width_]
        for row in range(count):
            rows[row] += [first + int(column) for column in np.flatnonzero(pattern[row])]
    return rows


def _token(system: HybridSystem, description: ModelDescription, equations: str) -> str:
    """A name for the content: other equations, variables, starts, options or events, another token."""
    content: list[object] = [
        description.fmiVersion,
        system.name,
        system.method,
        sorted(map(str, system.options.items())),
    ]
    content += [
        [getattr(v, name) for name in TOKEN_ATTRIBUTES] + list(v.clocks or ()) for v in description.modelVariables
    ]
    content += [[e.name, e.period, e.offset, len(e.noises)] for e in system.periodic_events]
    structure = (*description.outputs, *description.derivatives)
    content += [[u.variable.name, *(known.name for known in u.dependencies)] for u in structure]
    content += [equations]
    digest = hashlib.sha256(json.dumps(content).encode()).hexdigest()
    return f"{{{digest[:8]}-{digest[8:12]}-{digest[12:16]}-{digest[16:20]}-{digest[20:32]}}}"
