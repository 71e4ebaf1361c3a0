"""Kernels: how the functions of a hybrid system are evaluated at run time.

A kernel works in place on three arrays (state, inputs, parameters). `TracedKernel` calls CasADi functions through
preset buffers, `NumpyKernel` calls the Python functions themselves; both have the same interface and `runtime` cannot
distinguish them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, Protocol
from weakref import WeakKeyDictionary

import numpy as np

from plant_models.disk_cache.entries import remembered
from plant_models.disk_cache.identity import identity
from plant_models.hybrid import integration
from plant_models.hybrid.casadi_package import ca
from plant_models.hybrid.signal import scalar_names
from plant_models.hybrid.switching import divided_step
from plant_models.hybrid.system import HybridSystem
from plant_models.hybrid.tracing import traced_once

BATCH_OF_STEPS = 10

_traced: WeakKeyDictionary[HybridSystem, dict[str, ca.Function]] = WeakKeyDictionary()


class Kernel(Protocol):
    """In-place evaluation of one system.

    Attributes:
        x: state, shape (n,). u: inputs, payloads and noises, shape (m,). p: parameters, shape (k,). y: outputs, shape
        (q,).
        memory: x, u and p in one contiguous array of shape (n + m + k,), of which they are views.
        divisions: of internal steps at switches since the last event or end of a step, for whoever begins to set.
    """

    x: np.ndarray
    u: np.ndarray
    p: np.ndarray
    y: np.ndarray
    memory: np.ndarray
    divisions: int

    def step(self, t: float, h: float) -> None:
        """Advance `x` by one internal step of length `h` [s] from `t` [s], divided where switches change."""

    def grid_steps(self, t0: float, k: int, count: int, h: float) -> None:
        """Advance `x` by `count` full internal steps from grid point ``t0 + k*h``."""

    def output(self, t: float) -> None:
        """Compute `y` from `x`, `u`, `p` at `t` [s]."""

    def jump(self, event: str, t: float) -> None:
        """Replace `x` by its value after `event` at `t` [s]."""


def make_kernel(system: HybridSystem) -> Kernel:
    """The fastest kernel a system allows: traced where it can be traced, plain NumPy otherwise."""
    return TracedKernel(system) if system.traceable else NumpyKernel(system)


class _Arrays(ABC):
    def __init__(self, system: HybridSystem) -> None:
        parts = [system.start_state(), system.start_inputs(), system.start_parameters()]
        self.memory = np.concatenate(parts)
        n, m = len(parts[0]), len(parts[1])
        self.x, self.u, self.p = self.memory[:n], self.memory[n : n + m], self.memory[n + m :]
        self.y = np.zeros(sum(s.width for s in system.outputs))
        self.system, self.divisions = system, 0

    def accept_change(self, t: float, h: float) -> str:
        """See `Trial`."""
        before = self.system.switching_vector(t, self.x, self.u, self.p)
        self.accept()
        now = self.system.switching_vector(t + h, self.x, self.u, self.p)
        changed = (name for name, a, b in zip(self.system.switchings, before, now, strict=True) if (a >= 0) != (b >= 0))
        return next(changed, self.system.switchings[-1])

    @abstractmethod
    def accept(self) -> None:
        """See `Trial`."""


class NumpyKernel(_Arrays):
    """Evaluation by the system's own Python functions."""

    def __init__(self, system: HybridSystem) -> None:
        super().__init__(system)
        self._traced = traced_once(system) if system.method == "rosenbrock" else None
        self._x_next = self.x

    def attempt(self, t: float, h: float) -> bool:
        """See `Trial`."""
        jacobian = None if self._traced is None else self._jacobian
        self._x_next = integration.step(self.system, t, h, self.x, self.u, self.p, jacobian)
        now, then = (self.system.switch_vector(*at, self.u, self.p) for at in ((t, self.x), (t + h, self._x_next)))
        return not np.array_equal(now, then)

    def accept(self) -> None:
        """See `Trial`."""
        self.x[:] = self._x_next

    def step(self, t: float, h: float) -> None:
        divided_step(self, t, h)

    def grid_steps(self, t0: float, k: int, count: int, h: float) -> None:
        for i in range(count):
            self.step(t0 + (k + i) * h, h)

    def output(self, t: float) -> None:
        self.y[:] = self.system.output_vector(t, self.x, self.u, self.p)

    def jump(self, event: str, t: float) -> None:
        self.x[:] = self.system.jump_vector(event, t, self.x, self.u, self.p)

    def _jacobian(self, t: float, _continuous: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        assert self._traced is not None
        by_x, by_t = self._traced.effective_jacobian(t, self.x, self.u, self.p)
        return np.asarray(by_x), np.asarray(by_t).ravel()


class TracedKernel(_Arrays):
    """Evaluation by traced CasADi functions through preset buffers (a few microseconds a call, no allocation).

    Args:
        system: traced once, when the kernel is made.
    """

    def __init__(self, system: HybridSystem) -> None:
        super().__init__(system)
        functions = _traced_functions(system)
        self._t, self._h, self._t0, self._k = (np.zeros(1) for _ in range(4))
        self._x_next, self._switched = np.zeros_like(self.x), np.zeros(1)
        x, u, p = self.x, self.u, self.p
        stepped = (self._x_next, self._switched)
        self._step = _buffered(functions["step"], [self._t, self._h, x, u, p], *stepped)
        self._steps = _buffered(functions["steps"], [self._t0, self._k, self._h, x, u, p], *stepped)
        self._output = _buffered(functions["output"], [self._t, x, u, p], self.y)
        self._jumps = {
            event.name: _buffered(functions[f"jump_{event.name}"], [self._t, x, u, p], self._x_next)
            for event in system.events
        }
        self._flows = system.continuous_count > 0

    def attempt(self, t: float, h: float) -> bool:
        """See `Trial`."""
        self._t[0], self._h[0] = t, h
        self._step()
        return bool(self._switched[0])

    def accept(self) -> None:
        """See `Trial`."""
        self.x[:] = self._x_next

    def step(self, t: float, h: float) -> None:
        self.grid_steps(t, 0, 1, h)

    def grid_steps(self, t0: float, k: int, count: int, h: float) -> None:
        if not self._flows:
            return
        while count >= BATCH_OF_STEPS:
            self._t0[0], self._k[0], self._h[0] = t0, k, h
            self._steps()
            if self._switched[0]:
                for i in range(BATCH_OF_STEPS):
                    self.step(t0 + (k + i) * h, h)
            else:
                self.x[:] = self._x_next
            k += BATCH_OF_STEPS
            count -= BATCH_OF_STEPS
        for i in range(count):
            self._t[0], self._h[0] = t0 + (k + i) * h, h
            self._step()
            if self._switched[0]:
                divided_step(self, t0 + (k + i) * h, h)
            else:
                self.x[:] = self._x_next

    def output(self, t: float) -> None:
        self._t[0] = t
        self._output()

    def jump(self, event: str, t: float) -> None:
        self._t[0] = t
        self._jumps[event]()
        self.x[:] = self._x_next


def _buffered(function: ca.Function, arguments: list[np.ndarray], *results: np.ndarray) -> Callable[[], Any]:
    """A call of the function with these arrays, which are the caller's to keep."""
    for i, result in enumerate(results):
        if function.numel_out(i) != result.size:  # CasADi would write past the end of the array
            raise ValueError(f"{function.name()} returns {function.numel_out(i)} values, expected {result.size}.")
    buffer: Any  # CasADi's stubs ask for a size that its functions do not take
    evaluate: Any
    buffer, evaluate = function.buffer()
    for i, array in enumerate(arguments):
        buffer.set_arg(i, array.data)
    for i, result in enumerate(results):
        buffer.set_res(i, result.data)
    evaluate.alive = buffer, function  # they must outlive the call
    call: Callable[[], Any] = evaluate
    return call


def _traced_functions(system: HybridSystem) -> dict[str, ca.Function]:
    """The functions of a kernel by name, traced once in a process, and once ever where the system has an identity."""
    known = _traced.get(system)
    if known is None:
        texts = remembered("kernel", identity(system), lambda: _trace(system))
        known = _traced[system] = {name: ca.Function.deserialize(text) for name, text in texts.items()}
    return known


def _trace(system: HybridSystem) -> dict[str, str]:
    traced = traced_once(system)
    functions = {"step": traced.step, "steps": traced.steps(BATCH_OF_STEPS), "output": traced.output}
    functions |= {f"jump_{event.name}": traced.jump(event.name) for event in system.events}
    check_payloads(system, functions)
    return {name: _dense(function).serialize() for name, function in functions.items()}


def check_payloads(system: HybridSystem, functions: dict[str, ca.Function]) -> None:
    """Refuse a system that reads the payload of an event before or without that event: it would depend on when it was
    reported.

    Args:
        system: the hybrid system.
        functions: its traced functions with an argument ``u``: ``step`` and ``jump_<event>`` by these names.

    Raises:
        ValueError: a function other than the jump at the event reads its payload.
    """
    names = scalar_names(system.input_signals)
    own = {f"jump_{e.name}": set(scalar_names(e.payload)) for e in system.triggered_events}
    payloads = set().union(*own.values())
    for function_name, function in functions.items():
        if payloads and function_name not in ("steps", "output"):
            _, columns = function.jac_sparsity(0, function.index_in("u")).get_triplet()
            early = {names[column] for column in columns} & payloads - own.get(function_name, set())
            if early:
                raise ValueError(
                    f"{system.name}: {function_name} reads {', '.join(sorted(early))}, which is known only at the "
                    f"event; "
                    "keep it in memory in the jump at that event."
                )


def _dense(function: ca.Function) -> ca.Function:
    arguments = [
        ca.SX.sym(function.name_in(i), function.size1_in(i), function.size2_in(i)) for i in range(function.n_in())
    ]
    return ca.Function(function.name(), arguments, [ca.densify(result) for result in function.call(arguments)])
