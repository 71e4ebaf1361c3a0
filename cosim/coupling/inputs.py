"""The connected inputs of one component: gathered from the array of all values, then sent.

Gathering and sending are apart, because an algorithm may gather for all components before it steps any of them, and because an
input may follow a line between communication points instead of the gathered value.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from cosim.components.component import Component
from cosim.coupling.connection import Connection


class Inputs:
    """Connected inputs, in the order of the connections.

    Args:
        names: the inputs, shape (m,).
        sources: column of each one's source within `values`, shape (m,).
        factors, offsets: unit conversion ``input = factor * source + offset``, shape (m,).
        values: all outputs of all components, shape (n,).
        buffer: what `send` writes, shape (m,).
        send: writes `buffer` to the component.
    """

    def __init__(
        self, names: Sequence[str], sources: np.ndarray, factors: np.ndarray, offsets: np.ndarray, values: np.ndarray,
        buffer: np.ndarray, send: Callable[[], None],
    ) -> None:  # fmt: skip
        self.names, self.sources, self.factors, self.offsets = tuple(names), sources, factors, offsets
        self.buffer, self.send = buffer, send
        self.gather = _gatherer(sources, factors, offsets, values, buffer)

    def __len__(self) -> int:
        return len(self.names)


def connected_inputs(
    component: Component, connections: Sequence[Connection], columns: Mapping[tuple[str, str], int], values: np.ndarray
) -> Inputs:
    """The inputs of a component that have a source.

    Args:
        connections: of all components.
        columns: (component, output) -> column of `values`.
        values: all outputs of all components, shape (n,).
    """
    own = [c for c in connections if c.target[0] == component.name]
    send, buffer = component.writer([c.target[1] for c in own]) if own else (_nothing, np.zeros(0))
    sources = np.array([columns[c.source] for c in own], dtype=np.intp)
    factors, offsets = np.array([c.factor for c in own], dtype=float), np.array([c.offset for c in own], dtype=float)
    return Inputs([c.target[1] for c in own], sources, factors, offsets, values, buffer, send)


def _gatherer(
    sources: np.ndarray, factors: np.ndarray, offsets: np.ndarray, values: np.ndarray, buffer: np.ndarray
) -> Callable[[], None]:
    if not len(sources):
        return _nothing
    take = values.take

    def gather() -> None:
        take(sources, out=buffer, mode="clip")

    def gather_and_convert() -> None:
        take(sources, out=buffer, mode="clip")
        np.multiply(buffer, factors, out=buffer)
        np.add(buffer, offsets, out=buffer)

    converts = bool(np.any(factors != 1.0) or np.any(offsets != 0.0))
    return gather_and_convert if converts else gather


def _nothing() -> None:
    """No connected inputs."""
