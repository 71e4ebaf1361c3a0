"""Tracing: a hybrid system becomes CasADi functions, with exact Jacobians and sparsity.

The same NumPy code is handed symbolic arrays once; what comes back is a graph that runs without Python (`kernel`), that
is differentiated exactly (EKF, observability, directional derivatives) and from which C is generated (package `fmus`).
"""

from __future__ import annotations

import hashlib
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cached_property, lru_cache, partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from plant_models.hybrid import integration
from plant_models.hybrid.casadi_package import ca, demand_casadi
from plant_models.hybrid.system import HybridSystem
from plant_models.hybrid.tracing_error import TracingError

Expression = TypeVar("Expression")
FOUNDATION = Path(__file__).parent
WRITTEN_AS = {
    "state_derivative": "flow",
    "output_vector": "output",
    "jump_vector": "jump",
    "friction_vector": "friction",
}
"""What the user wrote, by what is traced."""

ADVICE = (
    "Write it in plain NumPy without branching on values: np.where instead of 'if', vector(...) instead of "
    "np.array([...]), "
    "np.sin instead of math.sin."
)


@dataclass(frozen=True)
class _Symbols:
    t: ca.SX
    h: ca.SX
    x: ca.SX
    u: ca.SX
    p: ca.SX
    held: ca.SX


class TracedSystem:
    """The CasADi functions of a hybrid system, each built on first use.

    Args:
        system: a traceable hybrid system.

    Raises:
        TracingError: on first use of a function that cannot be traced.
    """

    def __init__(self, system: HybridSystem) -> None:
        demand_casadi()
        if not system.traceable:
            raise TracingError(f"{system.name}: the system declares that it cannot be traced (traceable = False).")
        self.system = system
        self._symbols = _Symbols(
            ca.SX.sym("t"),
            ca.SX.sym("h"),
            ca.SX.sym("x", system.state_count),
            ca.SX.sym("u", len(system.start_inputs())),
            ca.SX.sym("p", len(system.start_parameters())),
            ca.SX.sym("s", len(system.frictions) + len(system.switchings)),
        )
        self._expressions: dict[tuple[str, ...], Any] = {}

    @cached_property
    def step(self) -> ca.Function:
        """One internal step: ``(t, h, x, u, p) -> x, switched``; `switched` counts the switches that change on the
        way.
        """
        s = self._symbols
        x_next = self._step_expression()
        results = [x_next, self._switched_expression(x_next)]
        return ca.Function(
            "step", [s.t, s.h, s.x, s.u, s.p], results, ["t", "h", "x", "u", "p"], ["x_next", "switched"]
        )

    def steps(self, count: int) -> ca.Function:
        """`count` full internal steps on the grid ``t0 + k*h`` in one call: ``(t0, k, h, x, u, p) -> x, switched``."""
        s = self._symbols
        start, index = ca.SX.sym("t0"), ca.SX.sym("k")
        x, switched = s.x, ca.SX(0.0)
        for i in range(count):
            x, more = self.step(start + (index + i) * s.h, s.h, x, s.u, s.p)
            switched += more
        return ca.Function(f"steps_{count}", [start, index, s.h, s.x, s.u, s.p], [x, switched], {"cse": True})

    @cached_property
    def output(self) -> ca.Function:
        """Outputs: ``(t, x, u, p) -> y``."""
        s = self._symbols
        return ca.Function("output", [s.t, s.x, s.u, s.p], [self._trace("output_vector")], ["t", "x", "u", "p"], ["y"])

    @cached_property
    def flow(self) -> ca.Function:
        """Derivatives of the continuous states without dry friction: ``(t, x, u, p) -> dx``."""
        s = self._symbols
        return ca.Function(
            "flow", [s.t, s.x, s.u, s.p], [self._trace("state_derivative")], ["t", "x", "u", "p"], ["dx"]
        )

    @cached_property
    def derivative(self) -> ca.Function:
        """Derivatives of the continuous states, dry friction resolved: ``(t, x, u, p, s) -> dx``.

        `s` is what a solver holds between events: signs (-1, 0, 1) of the states with dry friction, then the switches
        (0, 1), shape (len(frictions) + len(switchings),).
        """
        s = self._symbols
        return ca.Function("derivative", [s.t, s.x, s.u, s.p, s.held], [self._derivative_expression()])

    @cached_property
    def balance(self) -> ca.Function:
        """What decides on state events: ``(t, x, u, p, s) -> (flows, frictions, switching functions)``, stacked: what
        drives and what holds each state with dry friction, then the switching functions; `s` as in `derivative`."""
        s = self._symbols
        _, switches = self._held()
        t, _, x, u, p = self._arrays()
        parts = []
        if self.system.frictions:
            flows = self._guarded("flow", lambda: self.system.state_derivative(t, x, u, p, switches))
            parts = [flows[self.system.friction_indices()]]
            parts.append(self._guarded("friction", lambda: self.system.friction_vector(t, x, u, p, switches)))
        if self.system.switchings:
            parts.append(self._trace("switching_vector"))
        return ca.Function("balance", [s.t, s.x, s.u, s.p, s.held], [ca.vertcat(*parts)])

    @cached_property
    def requirements(self) -> ca.Function:
        """What parameters and start values must fulfil, in the declared order: ``(x, p) -> 1 where they do``."""
        _, _, x, _, p = self._arrays()
        values = self._guarded("requirements", lambda: self.system.requirement_vector(x, p))
        return ca.Function("requirements", [self._symbols.x, self._symbols.p], [values])

    @cached_property
    def tangent(self) -> ca.Function:
        """Exact directional derivative: ``(t, x, u, p, s, dt, dx, du, dp) -> (dy, d derivative)``, stacked, with `s`
        held.
        """
        s = self._symbols
        knowns = [s.t, s.x, s.u, s.p]
        seeds = [ca.SX.sym(name, *k.shape) for name, k in zip(("dt", "dx", "du", "dp"), knowns, strict=True)]
        unknowns = ca.vertcat(ca.SX(self._trace("output_vector")), self._derivative_expression())
        direction = ca.jtimes(unknowns, ca.vertcat(*knowns), ca.vertcat(*seeds))
        return ca.Function("tangent", [s.t, s.x, s.u, s.p, s.held, *seeds], [ca.densify(direction)])

    def jump(self, event: str) -> ca.Function:
        """State after an event: ``(t, x, u, p) -> x``."""
        s = self._symbols
        expression = self._trace("jump_vector", event)
        return ca.Function(f"jump_{event}", [s.t, s.x, s.u, s.p], [expression], ["t", "x", "u", "p"], ["x_next"])

    def jacobian(self, function: str, by: str) -> ca.Function:
        """Exact Jacobian of `flow` or `output`: ``(t, x, u, p) -> d function / d by``.

        Args:
            function: ``flow`` or ``output``.
            by: ``t``, ``x``, ``u`` or ``p``.
        """
        s = self._symbols
        expression = self._trace("state_derivative" if function == "flow" else "output_vector")
        derivative = ca.jacobian(expression, getattr(s, by))
        return ca.Function(
            f"{function}_by_{by}", [s.t, s.x, s.u, s.p], [ca.densify(derivative)], ["t", "x", "u", "p"], ["jacobian"]
        )

    def digest(self) -> str:
        """A digest that changes with any of the equations."""
        s = self._symbols
        names = ["state_derivative", "output_vector", *(["friction_vector"] if self.system.frictions else [])]
        names += ["switching_vector"] if self.system.switchings else []
        parts = [self._trace(name) for name in names]
        parts += [self._trace("jump_vector", event.name) for event in self.system.events]
        function = ca.Function("equations", [s.t, s.x, s.u, s.p], [ca.SX(part) for part in parts])
        return hashlib.sha256(function.serialize().encode()).hexdigest()

    def dependencies(self, function: str, by: str) -> np.ndarray:
        """Structural dependence on a variable group: boolean array, shape (rows, columns).

        Args:
            function: ``flow``, ``output`` or ``derivative`` (the flow with dry friction resolved).
            by: ``t``, ``x``, ``u`` or ``p``.
        """
        s = self._symbols
        if function == "derivative":
            expression = self._derivative_expression()
        else:
            expression = self._trace("state_derivative" if function == "flow" else "output_vector")
        pattern = ca.DM(ca.jacobian_sparsity(expression, getattr(s, by)), 1)
        dependent: np.ndarray = np.asarray(ca.densify(pattern), dtype=float).reshape(expression.numel(), -1) != 0.0
        return dependent

    @cached_property
    def effective_jacobian(self) -> ca.Function:
        """Jacobians of the flow with dry friction resolved: ``(t, x, u, p) -> (by continuous x, by t)``."""
        s = self._symbols
        by_x, by_t = self._effective_jacobian_expression()
        return ca.Function("effective_jacobian", [s.t, s.x, s.u, s.p], [ca.densify(by_x), ca.densify(by_t)])

    # -- internals --------------------------------------------------------------------------------------------------

    def _arrays(self) -> tuple[Any, Any, Any, Any, Any]:
        s = self._symbols
        x, u, p = (ca.ArrayInterface.SX(v, shape=(v.numel(),)) for v in (s.x, s.u, s.p))
        return ca.ArrayInterface.SX(s.t, shape=()), ca.ArrayInterface.SX(s.h, shape=()), x, u, p

    def _trace(self, function: str, *arguments: str) -> ca.SX:
        t, _, x, u, p = self._arrays()
        method = partial(getattr(self.system, function), *arguments, t, x, u, p)
        return self._once((function, *arguments), lambda: self._guarded(function, method))

    def _once(self, key: tuple[str, ...], compute: Callable[[], Expression]) -> Expression:
        """An expression of the symbols, of which several functions are made: computed once."""
        if key not in self._expressions:
            self._expressions[key] = compute()
        known: Expression = self._expressions[key]
        return known

    def _step_expression(self) -> ca.SX:
        t, h, x, u, p = self._arrays()

        def jacobian(_time: Any, _state: Any) -> tuple[Any, Any]:
            by_x, by_t = self._effective_jacobian_expression()
            count = self.system.continuous_count
            return ca.ArrayInterface.SX(ca.densify(by_x), shape=(count, count)), ca.ArrayInterface.SX(
                ca.densify(by_t), shape=(count,)
            )

        return self._guarded("flow", lambda: integration.step(self.system, t, h, x, u, p, jacobian))

    def _switched_expression(self, x_next: ca.SX) -> ca.SX:
        """How many switches are not at the end of a step what they are at its start."""
        if not self.system.switchings:
            return ca.SX(0.0)
        t, h, x, u, p = self._arrays()
        after = ca.ArrayInterface.SX(x_next, shape=(x_next.numel(),))
        switch = self.system.switch_vector
        changed = self._guarded("switching", lambda: np.abs(switch(t + h, after, u, p) - switch(t, x, u, p)))
        return ca.sum1(changed)

    def _held(self) -> tuple[Any, Any]:
        """Signs and switches as symbols; None where there are none."""
        count, held = len(self.system.frictions), self._symbols.held
        signs = ca.ArrayInterface.SX(held[:count], shape=(count,)) if count else None
        switches = ca.ArrayInterface.SX(held[count:], shape=(held.numel() - count,)) if self.system.switchings else None
        return signs, switches

    def _derivative_expression(self) -> ca.SX:
        return self._once(("derivative",), self._trace_derivative)

    def _trace_derivative(self) -> ca.SX:
        t, _, x, u, p = self._arrays()
        signs, switches = self._held()
        if not self.system.continuous_count:
            return ca.SX(0, 1)
        return self._guarded("flow", lambda: integration.effective_flow(self.system, t, x, u, p, signs, switches))

    def _effective_jacobian_expression(self) -> tuple[ca.SX, ca.SX]:
        return self._once(("effective jacobian",), self._trace_effective_jacobian)

    def _trace_effective_jacobian(self) -> tuple[ca.SX, ca.SX]:
        t, _, x, u, p = self._arrays()
        indices = self.system.friction_indices()
        sign = np.stack([np.sign(x[i]) for i in indices]) if indices else None
        derivative = self._guarded("flow", lambda: integration.effective_flow(self.system, t, x, u, p, sign))
        continuous = self._symbols.x[: self.system.continuous_count]
        return ca.jacobian(derivative, continuous), ca.jacobian(derivative, self._symbols.t)

    def _guarded(self, function: str, call: Any) -> ca.SX:
        try:
            with _symbols_are_no_numbers():
                value = call()
        except Exception as error:
            raise TracingError(self._explain(function, error)) from error
        return ca.SX(value) if getattr(value, "size", 1) else ca.SX(0, 1)

    def _explain(self, function: str, error: Exception) -> str:
        own = [
            f
            for f in traceback.extract_tb(error.__traceback__)
            if "casadi" not in f.filename and "numpy" not in f.filename
        ]
        users = [f for f in own if Path(f.filename).parent != FOUNDATION]
        if users:
            place = f"{users[-1].filename}:{users[-1].lineno}: {users[-1].line}"
        else:  # it returned something wrong, and is no longer on the stack
            code = getattr(type(self.system), WRITTEN_AS.get(function, function)).__code__
            place = f"{code.co_filename}:{code.co_firstlineno}"
        explained = bool(users) and "raise " in str(users[-1].line)  # in words of its own, which know better
        of_kind = isinstance(error, (AttributeError, NameError, LookupError)) or not users
        advice = "" if of_kind or explained else f" {ADVICE}"
        reason = str(error).removeprefix(f"{self.system.name}: ").removesuffix(".") + _hint(error)
        return f"{self.system.name}: cannot trace {WRITTEN_AS.get(function, function)}: {reason} (at {place}).{advice}"


def _hint(error: Exception) -> str:
    """The signals nearest to a misspelt one, of the named tuple that was asked for it."""
    if not isinstance(error, AttributeError) or error.name is None:
        return ""
    close = get_close_matches(error.name, getattr(error.obj, "_fields", ()), 3)
    return f"; did you mean {', '.join(map(repr, close))}?" if close else ""


@lru_cache(maxsize=8)
def traced_once(system: HybridSystem) -> TracedSystem:
    """The traced functions of a system, shared by all who ask for them one after the other.

    Args:
        system: a traceable hybrid system, as it will stay.

    Returns:
        The same object as long as the system is one of the last 8.

    Raises:
        TracingError: the system declares that it cannot be traced.
    """
    return TracedSystem(system)


@contextmanager
def _symbols_are_no_numbers() -> Iterator[None]:
    """While a function is traced, ``float(x[0])`` and ``math.sin(x[0])`` are refused: CasADi would make NaN of them
    silently.
    """
    symbolic: Any = ca.ArrayInterface
    usual = symbolic.__float__

    def refuse(array: Any) -> float:
        if not ca.SX(array).is_constant():
            raise TypeError("a traced value has no number, so float() and the functions of math do not work on it")
        return float(usual(array))

    symbolic.__float__ = refuse
    try:
        yield
    finally:
        symbolic.__float__ = usual
