"""The plan: everything a step needs, prepared once as contiguous arrays and calls without arguments.

One array `values` holds all outputs of all components, a contiguous slice each, which the FMUs write into directly. The
inputs of a component are gathered from it by index. The stepper executes the plan; nothing is looked up in a step.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cosim.components.component import NUMERIC_TYPES, Component
from cosim.coupling.connection import Connection
from cosim.errors import CouplingError, nearest
from cosim.results.result import SignalInfo

FLOATING_TYPES = frozenset({"Real", "Float64", "Float32"})


@dataclass
class PlannedComponent:
    """One component in the plan.

    Args:
        component: what is stepped.
        outputs: slice of `values` with its outputs, a view of shape (q,).
        read: reads the outputs into `values`.
        write: gathers and writes the connected inputs.
        columns: where the view lies in `values`.
        continuous: mask of the outputs that may be interpolated between communication points, shape (q,).
    """

    component: Component
    outputs: np.ndarray
    read: Callable[[], None]
    write: Callable[[], None]
    columns: slice
    continuous: np.ndarray

    def step(self, t: float, until: float) -> None:
        """Write inputs, advance, read outputs; times in [s]."""
        self.write()
        self.component.advance(t, until)
        self.read()


@dataclass
class Plan:
    """The prepared coupling.

    Args:
        steps: components in execution order.
        values: all outputs, shape (n,).
        signals: what each value is, in the same order.
        continuous: mask of the values that may be interpolated between communication points, shape (n,).
    """

    steps: list[PlannedComponent]
    values: np.ndarray
    signals: list[SignalInfo]
    continuous: np.ndarray

    def find(self, component: str) -> PlannedComponent:
        """The planned component of this name.

        Raises:
            CouplingError: there is none.
        """
        names = [s.component.name for s in self.steps]
        if component not in names:
            raise CouplingError(f"No component {component!r} in this run; {nearest(component, names)}")
        return self.steps[names.index(component)]

    def column(self, name: str) -> int:
        """Position of ``component.signal`` in `values`.

        Raises:
            CouplingError: the signal is neither an output nor recorded.
        """
        names = [s.name for s in self.signals]
        if name not in names:
            raise CouplingError(f"Signal {name!r} is neither an output nor recorded; {nearest(name, names)}")
        return names.index(name)


def make_plan(
    components: Mapping[str, Component], connections: Sequence[Connection], order: Sequence[str],
    extra: Mapping[str, Sequence[str]] | None = None,
) -> Plan:  # fmt: skip
    """Prepare the plan; the components must be instantiated.

    Args:
        components: by name. connections: checked. order: execution order.
        extra: variables besides the outputs to record, by component.

    Raises:
        CouplingError: a variable to record does not exist or is not a scalar number.
    """
    read_names = {n: _names_to_read(components[n], (extra or {}).get(n, ())) for n in order}
    total = sum(len(names) for names in read_names.values())
    values = np.zeros(total)
    columns: dict[tuple[str, str], int] = {}
    steps: list[PlannedComponent] = []
    signals: list[SignalInfo] = []
    position = 0
    for name in order:
        names = read_names[name]
        columns |= {(name, signal): position + i for i, signal in enumerate(names)}
        own = [_info(components[name], signal) for signal in names]
        signals += own
        span = slice(position, position + len(names))
        view = values[span]
        continuous = np.array([s.variability == "continuous" for s in own], dtype=bool)
        steps.append(PlannedComponent(components[name], view, components[name].reader(names, view), _unset, span, continuous))
        position += len(names)
    for step in steps:
        step.write = _input_writer(step.component, connections, columns, values)
    return Plan(steps, values, signals, np.concatenate([s.continuous for s in steps]) if steps else np.zeros(0, dtype=bool))


def _names_to_read(component: Component, extra: Sequence[str]) -> list[str]:
    names = component.names("output")
    for name in extra:
        variable = component.variable(name)
        if variable.type not in NUMERIC_TYPES or variable.shape:
            raise CouplingError(f"{component.name}.{name} cannot be recorded: only scalar numbers can.")
        if name not in names:
            names.append(name)
    return names


def _input_writer(
    component: Component, connections: Sequence[Connection], columns: Mapping[tuple[str, str], int], values: np.ndarray
) -> Callable[[], None]:
    own = [c for c in connections if c.target[0] == component.name]
    if not own:
        return _nothing
    write, buffer = component.writer([c.target[1] for c in own])
    index = np.array([columns[c.source] for c in own], dtype=np.intp)
    factors, offsets = np.array([c.factor for c in own]), np.array([c.offset for c in own])
    converts = bool(np.any(factors != 1.0) or np.any(offsets != 0.0))

    def gather_and_write() -> None:
        values.take(index, out=buffer, mode="clip")
        if converts:
            np.multiply(buffer, factors, out=buffer)
            np.add(buffer, offsets, out=buffer)
        write()

    return gather_and_write


def _info(component: Component, name: str) -> SignalInfo:
    variable = component.variables[name]
    declared = variable.declaredType
    display = variable.displayUnit or (declared.displayUnit if declared is not None else None)
    flows = variable.type in FLOATING_TYPES and variable.variability in (None, "continuous")
    unit = component.unit_name(name) or "1"
    return SignalInfo(
        f"{component.name}.{name}", unit, display, "continuous" if flows else "discrete", variable.description or ""
    )


def _nothing() -> None:
    """No connected inputs."""


def _unset() -> None:
    raise AssertionError("the plan is complete only when every component has its writer")
