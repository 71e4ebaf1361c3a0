"""The connected inputs of one component: gathered from the array of all values, then sent.

Gathering and sending are apart, because an algorithm may gather for all components before it steps any of them, and
because an input may follow a line between communication points instead of the gathered value.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Set

import numpy as np

from cosim.components.component import Component
from cosim.coupling.connection import Connection
from cosim.coupling.instants import Signal
from cosim.coupling.non_numeric import NonNumericInputs

FEW = 4  # inputs that are gathered faster one by one


class Inputs:
    """Connected inputs, in the order of the connections.

    Args:
        names: the inputs, shape (m,).
        sources: column of each one's source within the values of the plan, shape (m,).
        signals: the same as (component, variable), shape (m,).
        factors, offsets: unit conversion ``input = factor * source + offset``, shape (m,).
        values: all outputs of all components, now and after that as they were at the start of the step, shape (2 n,).
        buffer: what `send` writes, shape (m,).
        send: writes `buffer` to the component.
        tables: for an input whose values are mapped, its place -> {source: target}; a value without an entry passes
            unchanged.
        non_numeric: inputs that are no numbers, or integers beyond doubles, gathered and sent with the others; or None.

    `gather` takes what holds for a step: of held signals the value at its start. `gather_now` takes what the sources
    say now. `places` says where `gather` finds each value, shape (m,). `passing` are the places of those that are sent
    in Step Mode.
    """

    def __init__(
        self,
        names: Sequence[str],
        sources: np.ndarray,
        signals: Sequence[Signal],
        factors: np.ndarray,
        offsets: np.ndarray,
        values: np.ndarray,
        buffer: np.ndarray,
        send: Callable[[], None],
        tables: Mapping[int, Mapping[float, float]] | None = None,
        non_numeric: NonNumericInputs | None = None,
    ) -> None:
        self.names, self.sources, self.factors, self.offsets = tuple(names), sources, factors, offsets
        self.buffer, self.send = buffer, send
        self.tables = dict(tables or {})
        self.places, self._signals, self._count = sources.copy(), tuple(signals), len(values) // 2
        self._values, self.non_numeric = values, non_numeric
        self.gated, self.passing = False, np.arange(len(self.names))
        self.gather, self.gather_now = self._gathering(self.places), self._gathering(sources)
        if non_numeric is not None:
            self.gather, self.send = _both(self.gather, non_numeric.gather), _both(self.send, non_numeric.send)
            self.gather_now = _both(self.gather_now, non_numeric.gather_now)

    def _gathering(self, places: np.ndarray) -> Callable[[], None]:
        gather = _gatherer(places, self.factors, self.offsets, self._values, self.buffer)
        return _mapped(gather, self.tables, self.buffer)

    def __len__(self) -> int:
        return len(self.names)

    @property
    def held(self) -> np.ndarray:
        """Mask of the inputs whose signal is held over a step, shape (m,)."""
        return np.asarray(self.places >= self._count)

    def gate(self, send: Callable[[], None], passing: np.ndarray) -> None:
        """From now on a gate sends, and decides which inputs.

        Args:
            send: writes what the gate lets pass of `buffer`. passing: places of what it lets pass in Step Mode.
        """
        self.gated, self.send, self.passing = True, send, passing

    def hold(self, signals: Set[Signal]) -> None:
        """These signals are held over a step."""
        held = np.array([signal in signals for signal in self._signals], dtype=bool)
        self.places[:] = np.where(held, self.sources + self._count, self.sources)
        self.gather = self._gathering(self.places)
        if self.non_numeric is not None:
            self.non_numeric.hold(signals)
            self.gather = _both(self.gather, self.non_numeric.gather)


def connected_inputs(
    component: Component,
    connections: Sequence[Connection],
    columns: Mapping[tuple[str, str], int],
    values: np.ndarray,
    non_numeric: NonNumericInputs | None = None,
) -> Inputs:
    """The inputs of a component that have a source.

    Args:
        connections: of all components.
        columns: (component, output) -> column of the values of the plan.
        values: all outputs of all components, as for `Inputs`.
        non_numeric: the component's connected inputs that do not travel as doubles, if any.
    """
    own = [c for c in connections if c.target[0] == component.name and not c.exact]
    send, buffer = component.writer([c.target[1] for c in own]) if own else (_nothing, np.zeros(0))
    sources = np.array([columns[c.source] for c in own], dtype=np.intp)
    factors, offsets = np.array([c.factor for c in own], dtype=float), np.array([c.offset for c in own], dtype=float)
    tables = {place: dict(c.table) for place, c in enumerate(own) if c.table}
    signals = [c.source_variable for c in own]
    return Inputs(
        [c.target[1] for c in own], sources, signals, factors, offsets, values, buffer, send, tables, non_numeric
    )


def _both(first: Callable[[], None], second: Callable[[], None]) -> Callable[[], None]:
    if first is _nothing:
        return second

    def both() -> None:
        first()
        second()

    return both


def _gatherer(
    sources: np.ndarray, factors: np.ndarray, offsets: np.ndarray, values: np.ndarray, buffer: np.ndarray
) -> Callable[[], None]:
    if not len(sources):
        return _nothing
    take = values.take
    now, target = values.data, buffer.data
    pairs = list(enumerate(sources.tolist()))

    def gather_few() -> None:
        for place, source in pairs:
            target[place] = now[source]

    def gather() -> None:
        take(sources, out=buffer, mode="clip")

    def gather_and_convert() -> None:
        take(sources, out=buffer, mode="clip")
        np.multiply(buffer, factors, out=buffer)
        np.add(buffer, offsets, out=buffer)

    converts = bool(np.any(factors != 1.0) or np.any(offsets != 0.0))
    if converts:
        return gather_and_convert
    return gather_few if len(sources) <= FEW and buffer.dtype == np.float64 else gather


def _mapped(
    gather: Callable[[], None], tables: Mapping[int, Mapping[float, float]], buffer: np.ndarray
) -> Callable[[], None]:
    if not tables:
        return gather

    def gather_and_map() -> None:
        gather()
        for place, table in tables.items():
            value = float(buffer[place])
            buffer[place] = table.get(value, value)

    return gather_and_map


def _nothing() -> None:
    """No connected inputs."""
