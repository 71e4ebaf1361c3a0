"""The memory of a detector by name: from the flat state to a named tuple and back, as declared."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Sequence
from functools import cache
from typing import Any

from plant_models.hybrid.signal import Signal
from plant_models.hybrid.system import Array, vector


class NamedMemory:
    """Memory of many parts, in the order of its declaration.

    Args:
        signals: of the memory, scalars and vectors.
    """

    def __init__(self, signals: Sequence[Signal]) -> None:
        self.signals = tuple(signals)
        self._type = _named(tuple(s.name for s in self.signals))

    def unpack(self, x: Array) -> Any:
        """Named tuple of the parts.

        Args:
            x: flat state, shape (n,) or (n, members).

        Returns:
            A scalar as it stands in `x`, a vector of n as shape (n,) or (n, members).
        """
        parts, at = [], 0
        for signal in self.signals:
            parts.append(x[at] if signal.size is None else x[at : at + signal.size])
            at += signal.width
        return self._type(*parts)

    def pack(self, memory: Any, **changed: Array | Sequence[Array]) -> Array:
        """Flat state, shape (n,) or (n, members).

        Args:
            memory: named tuple of `unpack`. changed: new values by name; of a vector a sequence will do.

        Raises:
            ValueError: a vector has not as many values as declared, or a name is not one of the memory's.
        """
        scalars: list[Array] = []
        for signal, part in zip(self.signals, memory._replace(**changed), strict=True):
            if signal.size is None:
                scalars.append(part)
                continue
            if len(part) != signal.size:
                raise ValueError(f"Memory {signal.name!r} was given {len(part)} values; expected {signal.size}.")
            scalars.extend(part[i] for i in range(signal.size))
        return vector(*scalars)


@cache
def _named(names: tuple[str, ...]) -> Any:
    return namedtuple("Memory", names)
