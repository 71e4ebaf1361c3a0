"""Generation: the equations of a hybrid system become the C file ``model.c``.

CasADi writes the straight-line functions; this file adds the constant table (`runtime/model.h`) by which the runtime knows
them. It touches no files.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from fmpy.model_description import ModelDescription, ModelVariable

from fmu_observer.description import VariableTable, exposed_inputs
from plant_models.hybrid import HybridSystem, TracedSystem, scalar_names, width


class GenerationError(ValueError):
    """A system that cannot become C; the message says why and what to do."""


@dataclass(frozen=True)
class Equations:
    """The traced, densified functions of a system.

    Args:
        step: ``(t, h, x, u, p) -> x``, or None where nothing flows.
        output: ``(t, x, u, p) -> y``, or None without outputs.
        jumps: by event name, ``(t, x, u, p) -> x``.
    """

    step: ca.Function | None
    output: ca.Function | None
    jumps: dict[str, ca.Function]

    def functions(self) -> list[ca.Function]:
        """All of them, in a fixed order."""
        return [f for f in (self.step, self.output, *self.jumps.values()) if f is not None]

    def digest(self) -> str:
        """A digest that changes with any of the equations, much cheaper than generating their C."""
        return hashlib.sha256("\n".join(f.serialize() for f in self.functions()).encode()).hexdigest()


def trace_equations(system: HybridSystem) -> Equations:
    """Trace a system once.

    Raises:
        GenerationError: the system declares that it cannot be traced.
        TracingError: one of its functions cannot be traced, or returns the wrong number of values.
    """
    if not system.traceable:
        raise GenerationError(
            f"{system.name}: it uses Python that cannot be traced (traceable = False), so no C can be generated from it. "
            "Step it as a block in Python instead."
        )
    traced = TracedSystem(system)
    prefix = system.name
    return Equations(
        step=_dense(traced.step, f"{prefix}_step") if system.continuous_count else None,
        output=_dense(traced.output, f"{prefix}_output") if width(system.outputs) else None,
        jumps={event.name: _dense(traced.jump(event.name), f"{prefix}_jump_{event.name}") for event in system.events},
    )


def generate_model(system: HybridSystem, equations: Equations, description: ModelDescription, preset: str | None) -> str:
    """The text of ``model.c``.

    Args:
        system: the hybrid system.
        equations: its traced functions.
        description: its model description, whose value references and token the table repeats.
        preset: preset whose values are the start values; None for the system's default.
    """
    parts = [
        f"/* Generated from the hybrid system '{system.name}': its equations, and the table that describes them. */",
        '#include "model.h"\n',
        f"#define FMI_VERSION {str(description.fmiVersion)[0]}\n",
        "#define casadi_int int\n",
        _equations_source(system.name, equations),
        _start_arrays(system, preset),
        _event_tables(system, equations),
        _variable_table(system, description),
        _model_table(system, equations, str(description.instantiationToken)),
    ]
    return "\n".join(parts)


# -- equations ----------------------------------------------------------------------------------------------------------


def _dense(function: ca.Function, name: str) -> ca.Function:
    arguments = [ca.SX.sym(function.name_in(i), *function.size_in(i)) for i in range(function.n_in())]
    return ca.Function(name, arguments, [ca.densify(function(*arguments))])


def _equations_source(name: str, equations: Equations) -> str:
    options: dict[str, Any] = {"with_export": False, "casadi_int": "int", "prefix": name}
    generator = ca.CodeGenerator(f"{name}.c", options)
    for function in equations.functions():
        generator.add(function)
    source: str = generator.dump()
    return source.strip() + "\n"


# -- tables -------------------------------------------------------------------------------------------------------------


def _start_arrays(system: HybridSystem, preset: str | None) -> str:
    arrays = (
        ("start_x", system.start_state(preset)),
        ("start_u", system.start_inputs()),
        ("start_p", system.start_parameters(preset)),
    )
    return "".join(f"static const double {name}[] = {{{_numbers(values)}}};\n" for name, values in arrays)


def _event_tables(system: HybridSystem, equations: Equations) -> str:
    positions = {name: i for i, name in enumerate(scalar_names(system.parameter_signals))}
    periodic = [
        f"{_text(e.name)}, {equations.jumps[e.name].name()}, {positions[e.period]}, "
        f"{-1 if e.offset is None else positions[e.offset]}, {width(e.noises)}"
        for e in system.periodic_events
    ]
    triggered = []
    payload = width(system.inputs)
    for event in system.triggered_events:
        count = width(event.payload)
        triggered.append(f"{_text(event.name)}, {equations.jumps[event.name].name()}, {payload}, {count}")
        payload += count
    return _table("PeriodicEvent", "periodic", periodic) + _table("TriggeredEvent", "triggered", triggered)


def _variable_table(system: HybridSystem, description: ModelDescription) -> str:
    variables: Sequence[ModelVariable] = description.modelVariables
    if [v.valueReference for v in variables] != list(range(len(variables))):
        raise GenerationError(f"{system.name}: value references must count up from 0 in the order of the variables.")
    rows = [f"{_text(v.name)}, {_role(system, v)}" for v in variables]
    return _table("Variable", "variables", rows)


def _role(system: HybridSystem, variable: ModelVariable) -> str:
    """Role and index of a variable, as in `runtime/model.h`."""
    table, reference = VariableTable.of(system), int(variable.valueReference)
    if reference == 0:
        return "ROLE_TIME, 0"
    if reference >= table.events:
        announcer = "ROLE_COUNT" if variable.type == "Integer" else "ROLE_CLOCK"
        number, is_stamp = divmod(reference - table.events, 2)
        return f"{'ROLE_STAMP' if is_stamp else announcer}, {number}"
    if reference >= table.parameters:
        return f"{'ROLE_TUNABLE' if variable.variability == 'tunable' else 'ROLE_FIXED'}, {reference - table.parameters}"
    if reference >= table.states:
        return f"ROLE_STATE, {reference - table.states}"
    if reference >= table.outputs:
        return f"ROLE_OUTPUT, {reference - table.outputs}"
    position = reference - table.inputs
    return f"{'ROLE_INPUT' if position < width(system.inputs) else 'ROLE_PAYLOAD'}, {position}"


def _model_table(system: HybridSystem, equations: Equations, token: str) -> str:
    parameters = scalar_names(system.parameter_signals)
    functions = equations.functions()
    fields = {
        "name": _text(system.name),
        "token": _text(token),
        "states": system.state_count,
        "inputs": width(system.input_signals),
        "noise_offset": width(exposed_inputs(system)),
        "outputs": width(system.outputs),
        "parameters": len(parameters),
        "internal_step": parameters.index("internal_step"),
        "seed": parameters.index("seed") if "seed" in parameters else -1,
        "integer_work": max((f.sz_iw() for f in functions), default=0),
        "real_work": max((f.sz_w() for f in functions), default=0),
        "start_x": "start_x",
        "start_u": "start_u",
        "start_p": "start_p",
        "step": "NULL" if equations.step is None else equations.step.name(),
        "output": "NULL" if equations.output is None else equations.output.name(),
        "periodic_count": len(system.periodic_events),
        "periodic": "periodic",
        "triggered_count": len(system.triggered_events),
        "triggered": "triggered",
        "variable_count": VariableTable.of(system).end,
        "variables": "variables",
    }
    rows = "".join(f"    .{name} = {value},\n" for name, value in fields.items())
    return f"#include <stddef.h>\n\nPRIVATE const Model model = {{\n{rows}}};\n"


def _table(kind: str, name: str, rows: Iterable[str]) -> str:
    """A constant array; C knows no empty one, so it gets one row of zeros that nobody reads."""
    lines = "".join(f"    {{{row}}},\n" for row in rows) or "    {0},\n"
    return f"static const {kind} {name}[] = {{\n{lines}}};\n\n"


def _numbers(values: np.ndarray) -> str:
    if not np.all(np.isfinite(values)):
        raise GenerationError("A start value is not a finite number; FMI allows none such.")
    return ", ".join(repr(float(v)) for v in values) or "0.0"


def _text(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
