"""The plan: everything a step needs, prepared once as contiguous arrays and calls without arguments.

One array `values` holds all outputs of all components, a contiguous slice each, which the FMUs write into directly;
another one right behind it holds them as they were at the start of the step. The inputs of a component are gathered
from the two by index. The stepper executes the plan; nothing is looked up in a step.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from cosim.components.component import Component
from cosim.coupling.clocks import ClockConnection
from cosim.coupling.connection import Connection, local_sources
from cosim.coupling.inputs import connected_inputs
from cosim.coupling.instants import Signal
from cosim.coupling.non_numeric import Cells, Node, non_numeric_inputs
from cosim.coupling.planned import PlannedComponent, PlannedInterpolator
from cosim.errors import CouplingError, nearest
from cosim.results.result import SignalInfo
from cosim.results.shown_unit import own_scale
from fmus.fmi.types import NUMERIC_TYPES


class Service(Protocol):
    """Somebody who took over how components move, and remembers something within a step (`cosim.balises.service`)."""

    def save_within(self) -> Any:
        """What moving components changes."""

    def restore_within(self, state: Any) -> None:
        """Return to what was saved, as often as wanted: components are moved over the same way again.

        Args:
            state: as `save_within` or `save` gave it.
        """


FLOATING_TYPES = frozenset({"Real", "Float64", "Float32"})


@dataclass
class Plan:
    """The prepared coupling.

    Args:
        steps: components in execution order.
        values: all outputs, shape (n,).
        start: the same at the start of the step, shape (n,).
        signals: what each value is, in the same order.
        continuous: mask of the values that may be interpolated between communication points, shape (n,).
        can_be_missing: mask of the values of which NaN says that there is none, shape (n,); none of them is continuous.
        non_numeric: connected outputs that are no numbers, or integers beyond doubles; shape (m,), of objects. Whoever
            keeps and restores a copy of `values` does so with them.
        non_numeric_start: the same at the start of the step, shape (m,).
        connections: in the order of their targets in the plan.
        clocks: connections between clocks.
        services: who took over how components move.
        interpolators: of the components with lines.
        held: signals of which all targets take the value at the start of a step; see `cosim.coupling.instants`.
        before_start: of held signals that jumped when initialisation ended what they were before.
        relays: pass values on to those that belong to no step, while the components are initialised.

    Values behind those of the last step belong to something that is not stepped (a network).
    """

    steps: list[PlannedComponent]
    values: np.ndarray
    start: np.ndarray
    signals: list[SignalInfo]
    continuous: np.ndarray
    can_be_missing: np.ndarray
    non_numeric: np.ndarray
    non_numeric_start: np.ndarray
    connections: Sequence[Connection] = ()
    clocks: Sequence[ClockConnection] = ()
    services: list[Service] = field(default_factory=list)
    interpolators: list[PlannedInterpolator] = field(default_factory=list)
    held: Set[Signal] = frozenset()
    relays: list[Callable[[], None]] = field(default_factory=list)
    before_start: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._now, self._start = self.values.data, self.start.data  # copied three times faster than as arrays
        self._more_to_begin = len(self.non_numeric) > 0

    def hold(self, signals: Set[Signal]) -> None:
        """All targets of these signals, and of no others, take the value at the start of a step."""
        self.held = signals
        for step in self.steps:
            step.inputs.hold(signals)

    def begin_step(self) -> None:
        """A step begins, or a part of one: what the values are now is what is held over it."""
        self._start[:] = self._now
        if self._more_to_begin:
            self.non_numeric_start[:] = self.non_numeric
        for interpolator in self.interpolators:
            interpolator.begin()

    def note_jumps(self) -> None:
        """Initialisation ended: keep what held signals were before, which no row shows."""
        held = {".".join(c.source) for c in self.connections if c.source_variable in self.held}
        jumped = np.flatnonzero((self.values != self.start) & np.isfinite(self.start))
        self.before_start = {name: float(self.start[i]) for i in jumped if (name := self.signals[i].name) in held}

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

        Args:
            name: of the signal.

        Raises:
            CouplingError: the signal is neither an output nor recorded.
        """
        names = [s.name for s in self.signals]
        if name not in names:
            raise CouplingError(f"Signal {name!r} is neither an output nor recorded; {nearest(name, names)}")
        return names.index(name)


def make_plan(
    components: Mapping[str, Component],
    connections: Sequence[Connection],
    order: Sequence[str],
    extra: Mapping[str, Sequence[str]] | None = None,
    clocks: Sequence[ClockConnection] = (),
    still: Component | None = None,
) -> Plan:
    """Prepare the plan; the components must be instantiated.

    Args:
        components: by name. connections: checked. order: execution order.
        extra: variables besides the outputs to record, by component.
        clocks: checked connections between clocks.
        still: a component with outputs that is not stepped, and is none of `order`.

    Raises:
        CouplingError: a variable to record does not exist or is not a number.
    """
    connections = _in_order(connections, components, order)
    cells, places = _non_numeric_cells(connections)
    hidden = local_sources(connections, components)
    read = [(components[n], _names_to_read(components[n], (extra or {}).get(n, ()), hidden.get(n, ()))) for n in order]
    signals, columns, spans = _layout([*read, *([(still, still.names("output"))] if still is not None else [])])
    twice = np.zeros(2 * len(signals))
    values, start = twice[: len(signals)], twice[len(signals) :]
    missing = np.array([s.can_be_missing for s in signals], dtype=bool)
    continuous = np.array([s.variability == "continuous" for s in signals], dtype=bool) & ~missing
    steps = []
    for component, names in read:
        span = spans[component.name]
        reader = _with_non_numeric(component.reader(names, values[span]), component, places, cells)
        non_numeric = non_numeric_inputs(component, connections, places, cells)
        inputs = connected_inputs(component, connections, columns, twice, non_numeric)
        steps.append(PlannedComponent(component, values[span], reader, inputs, span, continuous[span]))
    now, before = cells[: len(places)], cells[len(places) :]
    return Plan(steps, values, start, signals, continuous, missing, now, before, connections, clocks)


def _layout(
    read: Sequence[tuple[Component, Sequence[str]]],
) -> tuple[list[SignalInfo], dict[tuple[str, str], int], dict[str, slice]]:
    """All signals in a row, the column of each (component, signal), and the columns of each component."""
    signals, columns, spans = list[SignalInfo](), dict[tuple[str, str], int](), dict[str, slice]()
    for component, names in read:
        first = len(signals)
        columns |= {(component.name, name): first + i for i, name in enumerate(names)}
        signals += [_info(component, name) for name in names]
        spans[component.name] = slice(first, len(signals))
    return signals, columns, spans


def _in_order(
    connections: Sequence[Connection], components: Mapping[str, Component], order: Sequence[str]
) -> list[Connection]:
    """The connections in the order of their targets, however they were listed: as executed, then as described."""
    place = {name: i for i, name in enumerate(order)}
    described = {(n, v.name): i for n in order for i, v in enumerate(components[n].description.modelVariables)}

    def key(c: Connection) -> tuple[int, int, str, int]:
        element = components[c.target[0]].variables.element(c.target[1])
        name = element.variable.name
        return place[c.target[0]], described.get((c.target[0], name), 0), name, element.index or 0

    return sorted(connections, key=key)


def _names_to_read(component: Component, extra: Sequence[str], sources: Sequence[str]) -> list[str]:
    names = component.names("output")
    names += [name for name in sources if name not in names and component.variable(name).type in NUMERIC_TYPES]
    for name in extra:
        kind = component.variable(name).type
        if kind not in NUMERIC_TYPES:
            raise CouplingError(
                f"{component.name}.{name} cannot be recorded: it is a {kind}, and results are a table of numbers. It "
                f"can be "
                "connected, and set as a parameter."
            )
        names += [element.name for element in component.elements(name) if element.name not in names]
    return names


def _info(component: Component, name: str) -> SignalInfo:
    variable = component.variables[name]
    display = component.displayed_unit(name)
    flows = variable.type in FLOATING_TYPES and variable.variability in (None, "continuous")
    unit = component.unit_name(name) or "1"
    return SignalInfo(
        f"{component.name}.{name}",
        unit,
        None if display is None else display.name,
        "continuous" if flows else "discrete",
        variable.description or "",
        component.can_be_missing(name),
        display_scale=None if display is None or display.unit is None else own_scale(display.name, display.unit),
    )


def _with_non_numeric(
    read_numbers: Callable[[], None], component: Component, places: Mapping[Node, int], cells: Cells
) -> Callable[[], None]:
    """A call that reads a component's numbers, and its exact sources into the cells where it has any."""
    wanted: dict[str, list[tuple[int, int]]] = {}
    for (owner, name), place in places.items():
        if owner == component.name:
            element = component.variables.element(name)
            wanted.setdefault(element.variable.name, []).append((element.index or 0, place))
    if not wanted:
        return read_numbers
    reads = [(component.exact_reader(name), entries) for name, entries in wanted.items()]

    def read() -> None:
        read_numbers()
        for call, entries in reads:
            values = call()
            for index, place in entries:
                cells[place] = values[index]

    return read


def _non_numeric_cells(connections: Sequence[Connection]) -> tuple[Cells, dict[Node, int]]:
    """The array of objects, shape (2 * number of exact sources,), and where each source is in it."""
    sources = list(dict.fromkeys(c.source for c in connections if c.exact))
    return np.empty(2 * len(sources), dtype=object), {source: i for i, source in enumerate(sources)}
