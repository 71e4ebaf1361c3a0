"""Exact Jacobians of functions written in plain NumPy, usable inside a system's own flow and jump.

The function is traced once by CasADi and differentiated; the result is again a function of numbers or of traced
symbols. It knows nothing of systems.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from plant_models.hybrid.arrays import Array
from plant_models.hybrid.casadi_package import ca


def exact_jacobian(
    function: Callable[[Array, Array], Array], states: int, inputs: int
) -> Callable[[Array, Array], Array]:
    """The Jacobian ``d function(x, u) / d x`` as a function of (x, u).

    Args:
        function: plain NumPy without branching on values; x of shape (states,), u of shape (inputs,), returns shape
            (rows,).
        states: number of states. inputs: number of inputs.

    Returns:
        A function of x and u that returns shape (rows, states), for numbers and for traced symbols.
    """
    x, u, columns = _traced(function, states, inputs)
    symbolic = ca.ArrayInterface.SX
    traced = ca.Function("jacobian", [x, u], [ca.densify(ca.jacobian(columns, x))])
    shape = (columns.numel(), states)

    def jacobian(at: Array, known: Array) -> Array:
        if isinstance(at, ca.ArrayInterface) or isinstance(known, ca.ArrayInterface):
            return symbolic(traced(ca.SX(at), ca.SX(known)), shape=shape)
        return np.asarray(traced(at, known), dtype=float).reshape(shape)

    return jacobian


def is_affine(function: Callable[[Array, Array], Array], states: int, inputs: int) -> bool:
    """Whether a function is affine in x: no entry of its exact Jacobian depends on x, whatever u is.

    Args:
        function: as for `exact_jacobian`. states: number of states. inputs: number of inputs.
    """
    x, _, columns = _traced(function, states, inputs)
    return not ca.depends_on(ca.simplify(ca.jacobian(columns, x)), x)


def _traced(function: Callable[[Array, Array], Array], states: int, inputs: int) -> tuple[Any, Any, Any]:
    """Symbols of x and u, and the function of them."""
    symbolic = ca.ArrayInterface.SX
    x, u = ca.SX.sym("x", states), ca.SX.sym("u", inputs)
    value = function(symbolic(x, shape=(states,)), symbolic(u, shape=(inputs,)))
    return x, u, ca.SX(value) if getattr(value, "size", 1) else ca.SX(0, 1)
