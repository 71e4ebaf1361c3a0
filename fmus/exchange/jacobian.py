"""The Jacobian of an FMU's derivatives by its directional derivatives: which variables, in what order. Knows
descriptions and arguments of calls only.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from fmpy.model_description import ModelDescription

from fmus.fmi.elements import elements_of
from fmus.fmi.standard import fmi_version

RatesAt = Callable[[np.ndarray], np.ndarray | None]
_SHIFT, _SHARE, _ROUNDING = 1e-7, 0.1, 1e3 * np.finfo(float).eps
"""Length of a difference, by how much a slope may miss it, and what evaluation loses; those of ``steps.c`` too."""


class DirectionalDerivatives:
    """Arguments of getDirectionalDerivative, one state after the other.

    Args:
        description: of the FMU, whose derivatives name their states, see `directional_derivatives`.
    """

    def __init__(self, description: ModelDescription) -> None:
        self.version = fmi_version(description)
        pairs = [(d.variable, d.variable.derivative) for d in description.derivatives]
        groups = [[element.name for element in elements_of(state)] for _, state in pairs]
        self.states = [name for group in groups for name in group]
        self.rates = [element.name for rate, _ in pairs for element in elements_of(rate)]
        self.count = len(self.states)
        self.unknowns = (ctypes.c_uint32 * len(pairs))(*(rate.valueReference for rate, _ in pairs))
        each = [(s.valueReference, len(g), i) for (_, s), g in zip(pairs, groups, strict=True) for i in range(len(g))]
        self.knowns = (ctypes.c_uint32 * self.count)(*(reference for reference, _, _ in each))
        self.sizes = (ctypes.c_int64 * self.count)(*(size for _, size, _ in each))
        self.places = (ctypes.c_int64 * self.count)(*(place for _, _, place in each))
        """Of each state the array that it is an element of: how many these are, and which one it is."""
        self.seed = (ctypes.c_double * max(self.sizes))()
        self.nominals, self.scratch = (ctypes.c_double * self.count)(), (ctypes.c_double * (3 * self.count))()
        """Magnitudes of the states, and room for states and derivatives."""

    def differing(self, x: np.ndarray, rates: np.ndarray, columns: np.ndarray, rates_at: RatesAt) -> int | None:
        """Number of a derivative whose slope along one direction lies outside of differences; None where none does.

        A solver believes a step as soon as the corrections by its Jacobian are small: one that is far too large gives
        wrong numbers and no error. So each is looked at, for one call of the derivatives. Where that says no, the
        difference the other way is had as well: between both lies any slope at a kink, and what bends goes to both
        sides. The same as in ``steps.c``.

        Args:
            x: states, shape (n,). rates: derivatives there, shape (n,).
            columns: the Jacobian, transposed, shape (n, n).
            rates_at: derivatives at other states, shape (n,); None where they cannot be had.
        """
        shares = np.array([0.5 + math.fmod(0.6180339887498949 * i, 1.0) for i in range(len(x))])
        along = shares * (np.abs(x) + np.array(self.nominals[:]))
        slope, size, found = along @ columns, along @ np.abs(columns), list[np.ndarray]()
        for shift in (_SHIFT, -_SHIFT):
            moved = rates_at(x + shift * along)
            if moved is None:
                return 0
            found.append((moved - rates) / shift)
            low, high = np.min(found, axis=0), np.max(found, axis=0)
            lost = 2.0 * np.abs(rates) + _SHIFT * np.maximum(np.abs(low), np.abs(high))
            most = _SHARE * size + _ROUNDING * lost / _SHIFT
            wrong = np.flatnonzero(~((slope >= low - most) & (slope <= high + most)))
            if not len(wrong):
                return None
        return int(wrong[0])

    def arguments(self, number: int, written: int) -> tuple[Any, ...]:
        """Arguments behind the instance for derivatives along a state, whose seed is set.

        Args:
            number: of the state. written: address of the doubles that the derivatives go to.
        """
        size = self.sizes[number]
        self.seed[:] = np.zeros(len(self.seed)).tolist()
        self.seed[self.places[number]] = 1.0
        doubles = ctypes.POINTER(ctypes.c_double)
        known = ctypes.cast(ctypes.byref(self.knowns, 4 * number), ctypes.POINTER(ctypes.c_uint32))
        seed, out = ctypes.cast(self.seed, doubles), ctypes.cast(written, doubles)
        if self.version == 2:
            return self.unknowns, len(self.unknowns), known, 1, seed, out
        return self.unknowns, len(self.unknowns), known, 1, seed, size, out, self.count


def directional_derivatives(description: ModelDescription, count: int) -> DirectionalDerivatives | None:
    """Those of an FMU; None where it declares none, or does not say which state each derivative belongs to.

    Args:
        description: of the FMU. count: of its states.
    """
    listed = [unknown.variable for unknown in description.derivatives]
    declared = getattr(description.modelExchange, "providesDirectionalDerivative", False)
    if not declared or not listed or any(rate.derivative is None for rate in listed):
        return None
    found = DirectionalDerivatives(description)
    return found if found.count == len(found.rates) == count else None
