"""Generation: the equations of a hybrid system become the C file ``model.c``.

CasADi writes the straight-line functions; this file adds the constant table (`runtime/model.h`) by which the runtime
knows them. It reads and writes no files.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from fmpy.model_description import ModelDescription, ModelVariable

from fmu_observer.description import FIRST_REFERENCE, VariableTable, exposed_inputs, referenced
from fmus.content.casadi_source import private_source
from fmus.content.rolled_loops import rolled_loops
from plant_models.hybrid import HybridSystem, TracedSystem, scalar_names, traced_once, width
from plant_models.hybrid.casadi_package import ca, demand_casadi
from plant_models.hybrid.kernel import check_payloads
from plant_models.hybrid.requirements import MOST_NAMED, named_values


class GenerationError(ValueError):
    """A system that cannot become C; the message says why and what to do."""


@dataclass(frozen=True)
class Equations:
    """The traced, densified functions of a system.

    Args:
        step: ``(t, h, x, u, p) -> x, switched``, the continuous states of x, or None where nothing flows.
        output: ``(t, x, u, p) -> y``, or None without outputs.
        jumps: by event name, ``(t, x, u, p) -> x``.
        derivative: ``(t, x, u, p, s) -> derivatives``, or None where nothing flows.
        balance: ``(t, x, u, p, s) -> flows, frictions, switching functions``, or None where all are empty.
        tangent: ``(t, x, u, p, s, dt, dx, du, dp) -> dy, d derivative``, or None where both are empty.
        requirements: ``(x, p) -> 1 for each that is fulfilled``, or None without any.
        requirement_texts: what is said where one is not.
        lasting_count: how many of them are not about start values alone; they come first.
    """

    step: ca.Function | None
    output: ca.Function | None
    jumps: dict[str, ca.Function]
    derivative: ca.Function | None
    balance: ca.Function | None
    tangent: ca.Function | None
    requirements: ca.Function | None
    requirement_texts: tuple[str, ...]
    lasting_count: int

    def functions(self) -> list[ca.Function]:
        """All of them, in a fixed order."""
        single = (self.step, self.output, self.derivative, self.balance, self.tangent, self.requirements)
        return [f for f in (*single, *self.jumps.values()) if f is not None]

    def digest(self) -> str:
        """A digest that changes with any of the equations, much cheaper than generating their C."""
        parts = [*(f.serialize() for f in self.functions()), *self.requirement_texts]
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def trace_equations(system: HybridSystem) -> Equations:
    """Trace a system once.

    Raises:
        GenerationError: the system declares that it cannot be traced.
        TracingError: one of its functions cannot be traced, or returns the wrong number of values.
        ValueError: it reads the payload of an event outside that event.
    """
    demand_casadi()
    if not system.traceable:
        raise GenerationError(
            f"{system.name}: it uses Python that cannot be traced (traceable = False), so no C can be generated from "
            "it. Step it as a block in Python, or export it with Python inside: fmus build ... --hosted."
        )
    traced = traced_once(system)
    if traced.digest() != TracedSystem(system).digest():
        raise GenerationError(
            f"{system.name}: its functions give other equations each time they are traced. They must depend on t, x, u "
            "and p only: no random numbers, no clock, nothing kept on self; declare noise at a periodic event."
        )
    jumps = {event.name: traced.jump(event.name) for event in system.events}
    named = {f"jump_{name}": function for name, function in jumps.items()}
    check_payloads(system, {"step": traced.step} | named if system.continuous_count else named)
    return _densified(system, traced, jumps)


def _densified(system: HybridSystem, traced: TracedSystem, jumps: Mapping[str, ca.Function]) -> Equations:
    prefix, flows, outputs = system.name, bool(system.continuous_count), bool(width(system.outputs))
    events, (lasting, at_start) = system.frictions or system.switchings, _requirement_texts(system)
    return Equations(
        step=_dense(traced.step, f"{prefix}_step", system.continuous_count) if flows else None,
        output=_dense(traced.output, f"{prefix}_output") if outputs else None,
        jumps={name: _dense(jump, f"{prefix}_jump_{name}") for name, jump in jumps.items()},
        derivative=_dense(traced.derivative, f"{prefix}_derivative") if flows else None,
        balance=_dense(traced.balance, f"{prefix}_balance") if events else None,
        tangent=_dense(traced.tangent, f"{prefix}_tangent") if flows or outputs else None,
        requirements=_dense(traced.requirements, f"{prefix}_requirements") if lasting or at_start else None,
        requirement_texts=(*lasting, *at_start),
        lasting_count=len(lasting),
    )


def generate_model(
    system: HybridSystem, equations: Equations, description: ModelDescription, preset: str | None
) -> str:
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
        "#include <stddef.h>",
        "#include <string.h>",
        "#define casadi_int int\n",
        _equations_source(system.name, equations),
        _start_arrays(system, preset),
        _event_tables(system, equations),
        _variable_table(system, description),
        _model_table(system, equations, description),
    ]
    return "\n".join(parts)


# -- equations --------------------------------------------------------------------------------------------------------


def _dense(function: ca.Function, name: str, rows: int | None = None) -> ca.Function:
    arguments = [ca.SX.sym(function.name_in(i), *function.size_in(i)) for i in range(function.n_in())]
    results = [ca.densify(result) for result in function.call(arguments)]
    return ca.Function(name, arguments, ca.cse([results[0][:rows], *results[1:]]))


def _requirement_texts(system: HybridSystem) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Of requirements that last, and of those of start values."""
    p = system.unpack_parameters(system.start_parameters())
    return tuple(system.requirements(p)), tuple(
        system.start_requirements(system.unpack_states(system.start_state()), p)
    )


def _equations_source(name: str, equations: Equations) -> str:
    options: dict[str, Any] = {"with_export": False, "casadi_int": "int", "prefix": name}
    generator = ca.CodeGenerator(f"{name}.c", options)
    for function in equations.functions():
        generator.add(function)
    source = private_source(generator.dump(), {function.name() for function in equations.functions()})
    roomy = [_with_room(function) for function in equations.functions() if _calls(function)]
    return "\n\n".join([rolled_loops(source).strip(), *roomy]) + "\n"


def _calls(function: ca.Function) -> bool:
    """Whether a function calls others, for which it needs room behind its arguments."""
    return bool(function.sz_arg() > function.n_in() or function.sz_res() > function.n_out())


def _with_room(function: ca.Function) -> str:
    """A function that calls others, with room behind its arguments and results."""
    lines = [f"static int {_name(function)}(const double **arg, double **res, int *iw, double *w, int mem) {{"]
    lines += [f"    const double *arguments[{function.sz_arg()}] = {{NULL}};"]
    lines += [f"    double *results[{function.sz_res()}] = {{NULL}};"]
    lines += [f"    arguments[{i}] = arg[{i}];" for i in range(function.n_in())]
    lines += [f"    results[{i}] = res[{i}];" for i in range(function.n_out())]
    return "\n".join([*lines, f"    return {function.name()}(arguments, results, iw, w, mem);", "}"])


# -- tables -----------------------------------------------------------------------------------------------------------


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
        f"{_text(e.name)}, {_name(equations.jumps[e.name])}, {positions[e.period]}, "
        f"{-1 if e.offset is None else positions[e.offset]}, {width(e.noises)}"
        for e in system.periodic_events
    ]
    triggered = []
    payload = width(system.inputs)
    for event in system.triggered_events:
        count = width(event.payload)
        triggered.append(
            f"{_text(event.name)}, {_name(equations.jumps[event.name])}, {payload}, {count}, "
            f"{system.verdict_index(event)}"
        )
        payload += count
    communications = [_name(equations.jumps[event.name]) for event in system.communication_events]
    tables = (
        ("PeriodicEvent", "periodic", periodic),
        ("TriggeredEvent", "triggered", triggered),
        ("ModelFunction", "communications", communications),
        ("Resource", "resources", _resource_rows(system)),
        ("int", "frictions", [str(i) for i in system.friction_indices()]),
        ("Requirement", "requirements", _requirement_rows(system, equations)),
    )
    return "".join(_table(*table) for table in tables)


def _resource_rows(system: HybridSystem) -> list[str]:
    first = {s.name: width(system.parameter_signals[:i]) for i, s in enumerate(system.parameter_signals)}
    sizes = {s.name: s.width for s in system.parameter_signals}
    return [f"{_text(r.file)}, {_text(r.column)}, {first[r.parameter]}, {sizes[r.parameter]}" for r in system.resources]


def _requirement_rows(system: HybridSystem, equations: Equations) -> list[str]:
    texts = equations.requirement_texts
    named = zip(texts, (places[:MOST_NAMED] for places in named_values(system, texts)), strict=True)
    return [f"{_text(text)}, {len(places)}, {{{', '.join(map(str, places or [0]))}}}" for text, places in named]


def _variable_table(system: HybridSystem, description: ModelDescription) -> str:
    variables: Sequence[ModelVariable] = description.modelVariables
    if [v.valueReference for v in variables] != list(range(FIRST_REFERENCE, FIRST_REFERENCE + len(variables))):
        raise GenerationError(
            f"{system.name}: value references must count up from {FIRST_REFERENCE} in the order of the variables."
        )
    table = VariableTable.of(system)
    rows = [f"{_text(v.name)}, {_role(system, table, v)}" for v in variables]
    return _table("Variable", "variables", rows)


def _role(system: HybridSystem, table: VariableTable, variable: ModelVariable) -> str:
    """Role and index of a variable, as in `runtime/model.h`."""
    reference = int(variable.valueReference)
    if table.events <= reference < table.protocol:
        number, is_stamp = divmod(reference - table.events, 2)
        return f"{'ROLE_STAMP' if is_stamp else 'ROLE_CLOCK' if variable.type == 'Clock' else 'ROLE_COUNT'}, {number}"
    if table.protocol <= reference < table.outcomes:
        return f"{'ROLE_POLICY' if reference == table.protocol else 'ROLE_HORIZON'}, 0"
    payload = table.inputs + width(system.inputs)
    blocks = (
        (table.indicators, "ROLE_INDICATOR"),
        (table.derivatives, "ROLE_DERIVATIVE"),
        (table.outcomes, "ROLE_OUTCOME"),
        (table.parameters, "ROLE_TUNABLE" if variable.variability == "tunable" else "ROLE_FIXED"),
        (table.states, "ROLE_STATE"),
        (table.outputs, "ROLE_OUTPUT" if variable.type in ("Real", "Float64") else "ROLE_INTEGER_OUTPUT"),
        (table.inputs, "ROLE_INPUT" if reference < payload else "ROLE_PAYLOAD"),
        (table.time, "ROLE_TIME"),
    )
    first, role = next(block for block in blocks if reference >= block[0])
    return f"{role}, {reference - first}"


def _model_table(system: HybridSystem, equations: Equations, description: ModelDescription) -> str:
    fields = {
        "name": _text(system.name),
        "token": _text(str(description.instantiationToken)),
        **_sizes(system, equations),
        "step": _name(equations.step),
        "output": _name(equations.output),
        **_event_fields(system, description),
        "friction_count": len(system.frictions),
        "frictions": "frictions",
        "switching_count": len(system.switchings),
        "balance": _name(equations.balance),
        "derivative": _name(equations.derivative),
        "tangent": _name(equations.tangent),
        "first_reference": FIRST_REFERENCE,
        "requirement_count": len(equations.requirement_texts),
        "lasting_count": equations.lasting_count,
        "requirements": "requirements",
        "fulfilled": _name(equations.requirements),
        "variable_count": len(description.modelVariables),
        "variables": "variables",
    }
    rows = "".join(f"    .{name} = {value},\n" for name, value in fields.items())
    return f"#include <stddef.h>\n\nPRIVATE const Model model = {{\n{rows}}};\n"


def _sizes(system: HybridSystem, equations: Equations) -> dict[str, Any]:
    """Sizes of arrays, places in them, and the arrays of start values."""
    parameters = scalar_names(system.parameter_signals)
    functions = equations.functions()
    return {
        "states": system.state_count,
        "continuous": system.continuous_count,
        "inputs": width(system.input_signals),
        "own_inputs": width(system.inputs),
        "noise_offset": width(exposed_inputs(system)),
        "outputs": width(system.outputs),
        "parameters": len(parameters),
        "internal_step": parameters.index("internal_step"),
        "seed": parameters.index("seed") if "seed" in parameters else -1,
        "purpose": int(system.purpose),
        "integer_work": max((f.sz_iw() for f in functions), default=0),
        "real_work": max((f.sz_w() for f in functions), default=0),
        "start_x": "start_x",
        "start_u": "start_u",
        "start_p": "start_p",
    }


def _event_fields(system: HybridSystem, description: ModelDescription) -> dict[str, Any]:
    """Tables of events and resources, how events are announced."""
    return {
        "periodic_count": len(system.periodic_events),
        "periodic": "periodic",
        "triggered_count": len(system.triggered_events),
        "triggered": "triggered",
        **_protocol(system, description),
        "communication_count": len(system.communication_events),
        "communications": "communications",
        "resource_count": len(system.resources),
        "resources": "resources",
    }


def _protocol(system: HybridSystem, description: ModelDescription) -> dict[str, str]:
    """How events are announced, from the description: the start values of its parameters are those of the library."""
    if not system.triggered_events:
        return {"counts_events": "false", "late_policy": "LATE_REJECT", "replay_horizon": "0.0"}
    table, variables = VariableTable.of(system), description.modelVariables
    policy, horizon = referenced(variables, table.protocol, 2)
    counts = "false" if referenced(variables, table.events)[0].type == "Clock" else "true"
    return {"counts_events": counts, "late_policy": f"(LatePolicy){policy.start}", "replay_horizon": str(horizon.start)}


def _name(function: ca.Function | None) -> str:
    """By which the table names a function."""
    if function is None:
        return "NULL"
    return f"{function.name()}_with_room" if _calls(function) else str(function.name())


def _table(kind: str, name: str, rows: Iterable[str]) -> str:
    """A constant array; C knows no empty one, so it gets one row of zeros that nobody reads."""
    opened, closed = ("", "") if kind in ("int", "ModelFunction") else ("{", "}")
    lines = "".join(f"    {opened}{row}{closed},\n" for row in rows) or f"    {opened}0{closed},\n"
    return f"static const {kind} {name}[] = {{\n{lines}}};\n\n"


def _numbers(values: np.ndarray) -> str:
    if not np.all(np.isfinite(values)):
        raise GenerationError("A start value is not a finite number; FMI allows none such.")
    return ", ".join(repr(float(v)) for v in values) or "0.0"


def _text(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
