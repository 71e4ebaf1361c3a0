"""Descriptions: a hybrid system as an fmpy `ModelDescription`.

One description serves the Python block and the exported FMU, so that names, value references, starts, units and
dependencies cannot drift apart. Uses fmpy's data classes and the hybrid system; touches no files.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from typing import Any

import numpy as np
from fmpy.model_description import (
    BaseUnit,
    Category,
    CoSimulation,
    DefaultExperiment,
    DisplayUnit,
    ModelDescription,
    ModelExchange,
    ModelVariable,
    Unit,
    Unknown,
)

from fmu_observer.description.variable_table import VariableTable, exposed_inputs, referenced
from fmu_observer.description.variables import FmiVersion, late_policy_type, model_variables
from fmu_observer.event_protocol import EventProtocol
from plant_models import hybrid
from plant_models.disk_cache.entries import remembered
from plant_models.disk_cache.identity import identity
from plant_models.hybrid import HybridSystem, width
from plant_models.hybrid.units import BASE_SYMBOLS, conversion, parse_unit
from plant_models.user_file import option_files, split_name

LOG_CATEGORIES = {
    "logStatusError": "Calls that were refused, and why",
    "logStatusDiscard": "Steps that could not be done and were undone",
    "logStatusWarning": "Events that came too late or were lost",
    "logEvents": "Events that were applied",
}

VERSION_STRINGS = {2: "2.0", 3: "3.0"}
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
        protocol: how it is notified of triggered events; by default as is usual in the FMI version.
        model_exchange: whether it is a model exchange FMU as well; only a traceable system without communication events
            can be.

    Raises:
        ValueError: the preset or the version of FMI is unknown, or the protocol is none of this version.
    """
    if fmi_version not in VERSION_STRINGS:
        raise ValueError(f"{system.name}: FMI version {fmi_version!r} is unknown; use 2 or 3.")
    protocol = protocol or EventProtocol()
    description = _without_structure(system, fmi_version, preset, protocol)
    description.modelName = model_name or system.name
    description.modelExchange = _model_exchange(system) if model_exchange else None
    _add_structure(system, description)
    return description


def _without_structure(
    system: HybridSystem, fmi_version: FmiVersion, preset: str | None, protocol: EventProtocol
) -> ModelDescription:
    """All but the model structure and the token."""
    variables = model_variables(system, fmi_version, preset, protocol)
    # text, as fmpy reads it from a file
    experiment = DefaultExperiment(startTime="0.0", stopTime="10.0", stepSize="0.01")
    return ModelDescription(
        fmiVersion=VERSION_STRINGS[fmi_version],
        description=" ".join(system.description.split()),
        generationTool="fmu-observer",
        variableNamingConvention="structured",
        coSimulation=_co_simulation(system, protocol.counts(fmi_version)),
        typeDefinitions=[late_policy_type()] if system.triggered_events else [],
        defaultExperiment=experiment,
        logCategories=[Category(name=name, description=text) for name, text in LOG_CATEGORIES.items()],
        unitDefinitions=_unit_definitions(variables),
        modelVariables=variables,
    )


def _add_structure(system: HybridSystem, description: ModelDescription) -> None:
    """What depends on what, and the token, which follows from it."""
    table, traced, variables = VariableTable.of(system), _traced_once(system), description.modelVariables
    outputs = _unknowns(variables, table.outputs, traced["output"])
    derivatives = _unknowns(variables, table.derivatives, traced["derivative"])
    # A master that knows none of these takes each to depend on every input, and sees algebraic loops where there
    # are none.
    description.initialUnknowns = [*outputs, *derivatives]
    description.outputs, description.derivatives = (
        [_while_running(system, u) for u in group] for group in (outputs, derivatives)
    )
    indicators = referenced(variables, table.indicators, len(system.frictions) + len(system.switchings))
    description.eventIndicators = [Unknown(index=v.valueReference, variable=v) for v in indicators]
    description.numberOfContinuousStates, description.numberOfEventIndicators = system.continuous_count, len(indicators)
    description.instantiationToken = _token(system, description, traced["equations"])


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


def _token(system: HybridSystem, description: ModelDescription, equations: str) -> str:
    """A name for the content: other equations, variables, starts, options or events, another token."""
    classes = {key: split_name(name)[1] for key, name in option_files(system.options).items()}  # wherever the file is
    content: list[object] = [
        description.fmiVersion,
        system.name,
        system.method,
        sorted(map(str, {**system.options, **classes}.items())),
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


def _unknowns(variables: list[ModelVariable], first: int, dependencies: list[list[int]]) -> list[Unknown]:
    """Outputs or derivatives at initialisation: each with the time, inputs, start values and parameters that it depends
    on.
    """
    found = []
    for variable, references in zip(referenced(variables, first, len(dependencies)), dependencies, strict=True):
        known = [known for reference in references for known in referenced(variables, reference)]
        found.append(_unknown(variable, known))
    return found


def _while_running(system: HybridSystem, unknown: Unknown) -> Unknown:
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


def _traced_once(system: HybridSystem) -> dict[str, Any]:
    """What only the traced equations show, remembered: ``output`` and ``derivative``, the value references that each
    row depends on, all of them where it cannot be traced; ``equations``, their digest, or the class.
    """
    return dict(remembered("description", identity(system, code=("fmu_observer",)), lambda: _traced(system)))


def _traced(system: HybridSystem) -> dict[str, Any]:
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
