"""Values read back: what an instance has of what it was set, so that one that ignores or bounds a value is seen."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from fmus.fmi.described import Described
from fmus.fmi.types import FLOATING_TYPES
from fmus.fmi.values import exact_reader

_SINGLE = 1e-6
"""Share by which a number may differ that the instance holds in single precision, as some tools do."""


@dataclass(frozen=True)
class NotTaken:
    """A value that an instance was set and does not have.

    Args:
        name: of the variable or element. stated: what it was set to. has: what it has.
    """

    name: str
    stated: Any
    has: Any

    def __str__(self) -> str:
        return f"{self.name} was set to {_short(self.stated)} and is {_short(self.has)}"


def not_taken(instance: Described, stated: Mapping[str, Any]) -> Iterator[NotTaken]:
    """The values that an instance does not have although they were set. One that cannot be read is left out.

    Args:
        instance: initialised, and not stepped since the values were set.
        stated: values by name of a variable, a list for an array row by row, or of an element.
    """
    for name, value in stated.items():
        has = _held(instance, name)
        if has is None:
            continue
        kind = instance.variables[name].type
        wanted = value if isinstance(value, list) else [value]
        apart = [(a, b) for a, b in zip(wanted, has, strict=False) if not _same(kind, a, b)]
        if apart:
            yield NotTaken(name, *apart[0])


def _held(instance: Described, name: str) -> list[Any] | None:
    """The values of a variable or the one of an element; None where the instance refuses to be read."""
    variable = instance.variables[name]
    with suppress(Exception):  # some may not be read before the first step, and some are only written
        values = list(exact_reader(instance, variable)())
        index = None if name in instance.variables else instance.variables.element(name).index
        return values if index is None else [values[index]]
    return None


def _same(kind: str | None, a: Any, b: Any) -> bool:
    if kind not in FLOATING_TYPES:
        return bool(a == b) or (kind in ("String", "Binary") and not b)  # a text that is written only
    return a == b or (math.isnan(a) and math.isnan(b)) or math.isclose(a, b, rel_tol=_SINGLE)


def _short(value: Any) -> str:
    return f"{value:.9g}" if isinstance(value, float) else repr(value)
