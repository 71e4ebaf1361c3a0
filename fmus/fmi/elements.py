"""Elements: scalars, and the elements of arrays by name (``x[1]``, ``m[2,3]``: from 1, row by row). Knows variables
only.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from fmpy.model_description import ModelVariable

from fmus.fmi.types import size

INDEXED = re.compile(r"(?P<base>.+)\[(?P<indices>\s*\d+\s*(?:,\s*\d+\s*)*)\]", re.DOTALL)


@dataclass(frozen=True)
class Element:
    """A scalar variable, or one element of an array.

    Args:
        name: ``x`` or ``x[2,3]``.
        variable: what holds it.
        index: place in the array, row by row from 0; None for a scalar.
    """

    name: str
    variable: ModelVariable
    index: int | None = None


class Variables(dict[str, ModelVariable]):
    """Variables by name; an element's name finds its array. Iteration and ``in`` know whole variables only."""

    def __missing__(self, name: str) -> ModelVariable:
        return self.element(name).variable

    def element(self, name: str) -> Element:
        """The scalar or element of this name.

        Raises:
            KeyError: there is none, or the name is that of a whole array.
        """
        if name in self:
            if self[name].shape:
                raise KeyError(name)
            return Element(name, self[name])
        match = INDEXED.fullmatch(name)
        base = None if match is None else self.get(match["base"])
        if match is None or base is None or not base.shape:
            raise KeyError(name)
        indices = [int(i) - 1 for i in match["indices"].split(",")]
        if len(indices) != len(base.shape) or not all(0 <= i < n for i, n in zip(indices, base.shape, strict=True)):
            raise KeyError(name)
        written = ",".join(str(i + 1) for i in indices)
        return Element(f"{base.name}[{written}]", base, int(np.ravel_multi_index(indices, base.shape)))

    def expanded(self, name: str) -> list[Element]:
        """The elements of a variable in row-major order; a scalar or a single element is alone.

        Args:
            name: variable, or element of an array.

        Raises:
            KeyError: there is no such variable or element.
        """
        if name in self and self[name].shape:
            return elements_of(self[name])
        return [self.element(name)]


def elements_of(variable: ModelVariable) -> list[Element]:
    """The elements of a variable in row-major order; a scalar is its only one."""
    if not variable.shape:
        return [Element(variable.name, variable)]
    places = product(*(range(1, n + 1) for n in variable.shape))
    return [Element(f"{variable.name}[{','.join(map(str, p))}]", variable, i) for i, p in enumerate(places)]


@dataclass(frozen=True)
class ElementLayout:
    """How scalars and elements lie in whole variables, which is how FMI reads and writes them.

    Args:
        variables: each once, in order of first use.
        positions: where each element is among the values of all variables, shape (elements,).
        total: number of values of all variables.
    """

    variables: tuple[ModelVariable, ...]
    positions: np.ndarray
    total: int

    @property
    def is_whole(self) -> bool:
        """Whether the elements are all values of the variables, in order, so that nothing has to be moved."""
        return len(self.positions) == self.total and bool(np.all(self.positions == np.arange(self.total)))

    @property
    def is_partial(self) -> bool:
        """Whether some element of an array is left out, so that a write must keep what it is."""
        return len(np.unique(self.positions)) < self.total


def layout(elements: Sequence[Element]) -> ElementLayout:
    """The layout of scalars and elements."""
    begin: dict[str, int] = {}
    variables: list[ModelVariable] = []
    total = 0
    for element in elements:
        if element.variable.name not in begin:
            begin[element.variable.name] = total
            variables.append(element.variable)
            total += size(element.variable)
    positions = [begin[e.variable.name] + (e.index or 0) for e in elements]
    return ElementLayout(tuple(variables), np.array(positions, dtype=np.intp), total)


def described(variable: ModelVariable) -> str:
    """What kind of variable it is, for messages: ``String``, ``Float64 array of shape (2, 3)``."""
    return f"{variable.type} array of shape {tuple(variable.shape)}" if variable.shape else str(variable.type)
