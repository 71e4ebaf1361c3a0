"""The plan: everything a step needs, prepared once as contiguous arrays and calls without arguments.

One array `values` holds all outputs of all components, a contiguous slice each, which the FMUs write into directly. The
inputs of a component are gathered from it by index. The stepper executes the plan; nothing is looked up in a step.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from cosim.components.component import NUMERIC_TYPES, Component
from cosim.coupling.connection import Connection
from cosim.coupling.inputs import Inputs, connected_inputs
from cosim.errors import CouplingError, nearest
from cosim.results.result import SignalInfo

Mover = Callable[[float, float], None]
FLOATING_TYPES = frozenset({"Real", "Float64", "Float32"})


@dataclass
class PlannedComponent:
    """One component in the plan.

    Args:
        component: what is stepped.
        outputs: slice of `values` with its outputs, a view of shape (q,).
        read: reads the outputs into `values`.
        inputs: its connected inputs.
        columns: where the view lies in `values`.
        continuous: mask of the outputs that may be interpolated between communication points, shape (q,).
        move: how it gets from one time to another [s] once its inputs are gathered; `drive`, unless a service takes it over (the
            watched plant is stepped by its localiser, a receiver through the telegrams that reach it).
    """

    component: Component
    outputs: np.ndarray
    read: Callable[[], None]
    inputs: Inputs
    columns: slice
    continuous: np.ndarray
    move: Mover = field(init=False)

    def __post_init__(self) -> None:
        self.move = self.drive

    def drive(self, t: float, until: float) -> None:
        """Send the gathered inputs, advance, read outputs; times in [s]."""
        self.inputs.send()
        self.component.advance(t, until)
        self.read()

    def write(self) -> None:
        """Gather and send the connected inputs."""
        self.inputs.gather()
        self.inputs.send()

    def step(self, t: float, until: float) -> None:
        """Gather the inputs and move from `t` to `until` [s]."""
        self.inputs.gather()
        self.move(t, until)


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
    columns: dict[tuple[str, str], int] = {}
    spans: dict[str, slice] = {}
    signals: list[SignalInfo] = []
    for name in order:
        first = len(signals)
        columns |= {(name, signal): first + i for i, signal in enumerate(read_names[name])}
        signals += [_info(components[name], signal) for signal in read_names[name]]
        spans[name] = slice(first, len(signals))
    values = np.zeros(len(signals))
    continuous = np.array([s.variability == "continuous" for s in signals], dtype=bool)
    steps = []
    for name in order:
        component, span = components[name], spans[name]
        read = component.reader(read_names[name], values[span])
        inputs = connected_inputs(component, connections, columns, values)
        steps.append(PlannedComponent(component, values[span], read, inputs, span, continuous[span]))
    return Plan(steps, values, signals, continuous)


def _names_to_read(component: Component, extra: Sequence[str]) -> list[str]:
    names = component.names("output")
    for name in extra:
        variable = component.variable(name)
        if variable.type not in NUMERIC_TYPES or variable.shape:
            raise CouplingError(f"{component.name}.{name} cannot be recorded: only scalar numbers can.")
        if name not in names:
            names.append(name)
    return names


def _info(component: Component, name: str) -> SignalInfo:
    variable = component.variables[name]
    declared = variable.declaredType
    display = variable.displayUnit or (declared.displayUnit if declared is not None else None)
    flows = variable.type in FLOATING_TYPES and variable.variability in (None, "continuous")
    unit = component.unit_name(name) or "1"
    return SignalInfo(
        f"{component.name}.{name}", unit, display, "continuous" if flows else "discrete", variable.description or ""
    )
