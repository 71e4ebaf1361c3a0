"""What outputs and derivatives depend on, as the traced equations tell it. Remembered on disk."""

from __future__ import annotations

from typing import Any

import numpy as np
from fmpy.model_description import ModelVariable, Unknown

from fmu_observer.description.variable_table import VariableTable, exposed_inputs, referenced
from plant_models import hybrid
from plant_models.disk_cache.entries import remembered
from plant_models.disk_cache.identity import identity
from plant_models.hybrid import HybridSystem, width


def unknowns(variables: list[ModelVariable], first: int, dependencies: list[list[int]]) -> list[Unknown]:
    """Outputs or derivatives at initialisation: each with the time, inputs, start values and parameters that it depends
    on.

    Args:
        variables: of the description. first: value reference of the first of the outputs or derivatives.
        dependencies: for each of them the value references that it depends on.
    """
    found = []
    for variable, references in zip(referenced(variables, first, len(dependencies)), dependencies, strict=True):
        known = [known for reference in references for known in referenced(variables, reference)]
        found.append(_unknown(variable, known))
    return found


def while_running(system: HybridSystem, unknown: Unknown) -> Unknown:
    """The same once time runs: what it depends on among time, inputs and continuous states.

    Args:
        system: the hybrid system. unknown: at initialisation.
    """
    table = VariableTable.of(system)
    last = table.states + system.continuous_count
    known = (
        v for v in unknown.dependencies if v.valueReference < table.outputs or table.states <= v.valueReference < last
    )
    return _unknown(unknown.variable, list(known))


def _unknown(variable: ModelVariable, known: list[ModelVariable]) -> Unknown:
    kinds = ["dependent"] * len(known)
    return Unknown(index=variable.valueReference, variable=variable, dependencies=known, dependenciesKind=kinds)


def traced_facts(system: HybridSystem) -> dict[str, Any]:
    """What only the traced equations tell, remembered: ``output`` and ``derivative``, the value references that each
    row depends on, all of them where it cannot be traced; ``equations``, their digest, or the class.

    Args:
        system: the hybrid system.
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
