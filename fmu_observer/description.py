"""Descriptions: a hybrid system as an fmpy `ModelDescription`.

One description serves the Python block and the exported FMU, so that names, value references, starts, units and
dependencies cannot drift apart. Uses fmpy's data classes and the hybrid system; touches no files.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from fmpy.model_description import (
    BaseUnit,
    Category,
    CoSimulation,
    DefaultExperiment,
    DisplayUnit,
    ModelDescription,
    ModelVariable,
    Unit,
    Unknown,
)

from plant_models.hybrid import HybridSystem, Signal, TracedSystem, TriggeredEvent, width
from plant_models.hybrid.units import BASE_SYMBOLS, conversion, parse_unit

FmiVersion = Literal[2, 3]

STAMP_NOW = -1.0e30
"""Start value of ``<event>_time``: the event happened at the time at which it is told."""

VERSION_STRINGS = {2: "2.0", 3: "3.0"}
TOKEN_ATTRIBUTES = (
    "name", "valueReference", "type", "causality", "variability", "initial", "start", "min", "max", "unit", "displayUnit",
)  # fmt: skip


@dataclass(frozen=True)
class VariableTable:
    """Value references of a system: 0 is time, then contiguous blocks in this order.

    Args:
        inputs: first value reference of inputs and payloads (noise is not exposed).
        outputs: first of the outputs. states: first of the states. parameters: first of the parameters.
        events: first of the event variables, two for each triggered event (clock or count, then stamp).
        end: first value reference that is not used.
    """

    inputs: int
    outputs: int
    states: int
    parameters: int
    events: int
    end: int

    @classmethod
    def of(cls, system: HybridSystem) -> VariableTable:
        """The table of a system, the same for FMI 2 and FMI 3."""
        counts = [width(exposed_inputs(system)), width(system.outputs), system.state_count, width(system.parameter_signals)]
        inputs, outputs, states, parameters, events = (1 + sum(counts[:i]) for i in range(5))
        return cls(inputs, outputs, states, parameters, events, end=events + 2 * len(system.triggered_events))


def exposed_inputs(system: HybridSystem) -> tuple[Signal, ...]:
    """Inputs and event payloads, without the noises that the runtime draws itself."""
    return system.input_signals[: len(system.input_signals) - len(system.noises)]


def describe(
    system: HybridSystem, fmi_version: FmiVersion, *, preset: str | None = None, model_name: str | None = None
) -> ModelDescription:
    """The model description of a system as a co-simulation FMU.

    Args:
        system: the hybrid system.
        fmi_version: 2 or 3.
        preset: preset whose values become the start values; None for the system's default.
        model_name: name to show; None for the system's own.

    Raises:
        ValueError: the preset or the version of FMI is unknown.
    """
    if fmi_version not in VERSION_STRINGS:
        raise ValueError(f"{system.name}: FMI version {fmi_version!r} is unknown; use 2 or 3.")
    variables = _variables(system, fmi_version, preset)
    experiment = DefaultExperiment(startTime="0.0", stopTime="10.0", stepSize="0.01")  # text, as fmpy reads it from a file
    description = ModelDescription(
        fmiVersion=VERSION_STRINGS[fmi_version],
        modelName=model_name or system.name,
        description=" ".join(system.description.split()),
        generationTool="fmu-observer",
        variableNamingConvention="structured",
        coSimulation=_co_simulation(system, fmi_version),
        defaultExperiment=experiment,
        logCategories=[Category(name="logStatusError", description="Calls that failed, and why")],
        unitDefinitions=_unit_definitions(variables),
        modelVariables=variables,
    )
    description.outputs = _output_structure(system, variables)
    description.initialUnknowns = [Unknown(index=u.index, variable=u.variable) for u in description.outputs]
    description.instantiationToken = _token(system, description)
    return description


def _co_simulation(system: HybridSystem, fmi_version: FmiVersion) -> CoSimulation:
    return CoSimulation(
        modelIdentifier=system.name,
        canHandleVariableCommunicationStepSize=True,
        canGetAndSetFMUstate=True,
        canSerializeFMUstate=True,
        hasEventMode=fmi_version == 3 and bool(system.triggered_events),
    )


def _variables(system: HybridSystem, fmi_version: FmiVersion, preset: str | None) -> list[ModelVariable]:
    table = VariableTable.of(system)
    real = "Real" if fmi_version == 2 else "Float64"
    starts = _start_values(system, preset)
    time = _variable("time", 0, real, "independent", "continuous", unit="s", description="Simulation time")
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
        variables += _event_variables(event, table.events + 2 * i, fmi_version)
    if fmi_version == 3:
        _assign_clocks(system, variables)
    return variables


def _signal_variable(signal: Signal, name: str, reference: int, real: str, starts: dict[str, float]) -> ModelVariable:
    initial = {"output": "calculated", "local": "exact", "parameter": "exact"}.get(signal.causality)
    start = None if signal.causality == "output" else starts[name]
    variable = _variable(
        name, reference, real, signal.causality, signal.variability, initial, signal.unit, start, signal.description
    )
    variable.displayUnit = signal.display_unit
    variable.min = None if signal.min is None else repr(float(signal.min))
    variable.max = None if signal.max is None else repr(float(signal.max))
    return variable


def _event_variables(event: TriggeredEvent, reference: int, fmi_version: FmiVersion) -> list[ModelVariable]:
    what = event.description or f"event {event.name}"
    stamp_text = f"Instant of the {event.name}; start value: at the current time"
    if fmi_version == 2:
        counter = _variable(
            f"{event.name}_count", reference, "Integer", "input", "discrete", start=0, description=f"Raise by one: {what}"
        )
        real = "Real"
    else:
        counter = _variable(event.name, reference, "Clock", "input", "discrete", description=what)
        counter.intervalVariability = "triggered"
        real = "Float64"
    stamp = _variable(f"{event.name}_time", reference + 1, real, "input", "discrete", None, "s", STAMP_NOW, stamp_text)
    return [counter, stamp]


def _assign_clocks(system: HybridSystem, variables: list[ModelVariable]) -> None:
    by_name = {v.name: v for v in variables}
    for event in system.triggered_events:
        clock = by_name[event.name].valueReference
        payload = [name for signal in event.payload for name in signal.scalar_names]
        for name in [*payload, f"{event.name}_time"]:
            by_name[name].clocks = [clock]


def _variable(
    name: str, reference: int, kind: str, causality: str, variability: str, initial: str | None = None,
    unit: str | None = None, start: float | None = None, description: str = "",
) -> ModelVariable:  # fmt: skip
    python_type: type = {"Integer": int, "Clock": bool}.get(kind, float)
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


def _output_structure(system: HybridSystem, variables: list[ModelVariable]) -> list[Unknown]:
    table = VariableTable.of(system)
    count = width(system.outputs)
    feedthrough = _feedthrough(system)
    unknowns = []
    for row in range(count):
        known = [variables[table.inputs + int(column)] for column in np.flatnonzero(feedthrough[row])]
        reference = table.outputs + row
        unknown = Unknown(index=reference + 1, variable=variables[reference], dependencies=known)
        unknown.dependenciesKind = ["dependent"] * len(known)
        unknowns.append(unknown)
    return unknowns


def _feedthrough(system: HybridSystem) -> np.ndarray:
    """Which outputs depend directly on which exposed inputs: shape (outputs, inputs); all where it cannot be traced."""
    shape = (width(system.outputs), width(exposed_inputs(system)))
    if not system.traceable:
        return np.ones(shape, dtype=bool)
    if 0 in shape:
        return np.zeros(shape, dtype=bool)
    return TracedSystem(system).dependencies("output", "u")[:, : shape[1]]


def _token(system: HybridSystem, description: ModelDescription) -> str:
    """A name for the content: other equations, variables, starts, options or events, another token."""
    content: list[object] = [description.fmiVersion, system.name, system.method, sorted(map(str, system.options.items()))]
    content += [[getattr(v, name) for name in TOKEN_ATTRIBUTES] + list(v.clocks or ()) for v in description.modelVariables]
    content += [[e.name, e.period, e.offset, len(e.noises)] for e in system.periodic_events]
    content += [[u.variable.name, *(known.name for known in u.dependencies)] for u in description.outputs]
    content += [TracedSystem(system).digest() if system.traceable else type(system).__qualname__]
    digest = hashlib.sha256(json.dumps(content).encode()).hexdigest()
    return f"{{{digest[:8]}-{digest[8:12]}-{digest[12:16]}-{digest[16:20]}-{digest[20:32]}}}"
