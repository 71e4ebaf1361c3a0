"""Non-numeric values: texts, bytes and 64-bit integers on their way from outputs to inputs, as Python objects beside
the doubles.

One array of objects `cells` for the whole plan, two for each connected source (now, and as it was at the start of the
step), is to these values what the doubled values of the plan are to the numbers: outputs are read into it, inputs are
gathered from it, and whoever keeps a copy of the one keeps one of the other.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Set
from typing import Any

import numpy as np

from cosim.components.component import Component
from cosim.coupling.connection import Connection
from cosim.coupling.instants import Signal

Cells = np.ndarray
Node = tuple[str, str]
Write = tuple[Callable[[Sequence[Any]], None], Callable[[], Sequence[Any]], bool, list[tuple[int, int]]]
"""Writes a variable, reads it, whether all its elements have a source, and (element, place among the inputs) of those
that do.
"""


def non_numeric_inputs(
    component: Component, connections: Sequence[Connection], places: Mapping[Node, int], cells: Cells
) -> NonNumericInputs | None:
    """The exact inputs of a component that have a source, or None where there are none.

    Args:
        connections: of the run. places: column of each signal in the row of values.
        cells: of the non-numeric values.
    """
    own = [c for c in connections if c.exact and c.target[0] == component.name]
    return NonNumericInputs(component, own, places, cells) if own else None


class NonNumericInputs:
    """The exact inputs of one component: gathered from the cells, then sent; see `cosim.coupling.inputs`.

    Args:
        component: whose inputs they are. connections: exact ones to it.
        places: (component, output) -> place in `cells`. cells: of the whole plan.
    """

    def __init__(
        self, component: Component, connections: Sequence[Connection], places: Mapping[Node, int], cells: Cells
    ) -> None:
        self.names = tuple(c.target[1] for c in connections)
        self._cells = cells
        self._writes: list[Write] = []
        self._held: list[object] = [None] * len(connections)
        self._sources = [places[c.source] for c in connections]
        self._signals, self._places = [c.source_variable for c in connections], list(self._sources)
        targets: dict[str, list[tuple[int, int]]] = {}
        for i, connection in enumerate(connections):
            element = component.variables.element(connection.target[1])
            targets.setdefault(element.variable.name, []).append((element.index or 0, i))
        for name, entries in targets.items():
            whole = len(entries) == len(component.elements(name))
            self._writes.append((component.exact_writer(name), component.exact_reader(name), whole, sorted(entries)))

    def __len__(self) -> int:
        return len(self.names)

    @property
    def held(self) -> tuple[object, ...]:
        """What was gathered last."""
        return tuple(self._held)

    def hold(self, signals: Set[Signal]) -> None:
        """These signals are held over a step."""
        later = len(self._cells) // 2
        self._places = [
            place + later * (signal in signals) for place, signal in zip(self._sources, self._signals, strict=True)
        ]

    def gather(self) -> None:
        """Take what holds for a step from the cells: of held signals the value at its start."""
        self._held = [self._cells[place] for place in self._places]

    def gather_now(self) -> None:
        """Take what the sources say now."""
        self._held = [self._cells[place] for place in self._sources]

    def send(self) -> None:
        """Write them to the component, whole variables at a time.

        Elements without a source keep their values, and so does all that no source has been read for: the first
        exchange of a loop begins with what the components were started with.
        """
        for write, read, whole, entries in self._writes:
            known = [(index, self._held[i]) for index, i in entries if self._held[i] is not None]
            if whole and len(known) == len(entries):
                write([value for _, value in known])
            elif known:
                values = list(read())
                for index, value in known:
                    values[index] = value
                write(values)
