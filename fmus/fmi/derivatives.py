"""Derivatives that slaves take and give: of inputs in time (FMI 1, 2), and directional derivatives (FMI 2, 3)."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from fmus.fmi.elements import ElementLayout
from fmus.fmi.ports import is_native


def input_derivative_writer(
    slave: Any, fmi_version: int, references: Sequence[int], values: np.ndarray
) -> Callable[[], None]:
    """A call of setRealInputDerivatives of first order.

    Args:
        slave: instantiated, with fmpy's call surface.
        fmi_version: 1 or 2.
        references: value references of the inputs.
        values: what is written, shape (len(references),), contiguous.

    Returns:
        The call, prepared once; it takes no arguments.
    """
    count, orders = len(references), [1] * len(references)
    if not is_native(slave):
        return lambda: slave.setRealInputDerivatives(list(references), orders, values.tolist())
    call = getattr(slave, f"fmi{fmi_version}SetRealInputDerivatives")
    pointer = values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))  # keeps the array alive
    arguments = (slave.component, (ctypes.c_uint32 * count)(*references), count, (ctypes.c_int * count)(*orders))

    def write() -> None:
        call(*arguments, pointer)

    return write


def directional_derivative(
    slave: Any, unknowns: ElementLayout, knowns: ElementLayout, seed: Sequence[float]
) -> Callable[[], np.ndarray]:
    """A call of getDirectionalDerivative.

    Args:
        slave: instantiated, with fmpy's call surface.
        unknowns: whose derivatives are asked for.
        knowns: along which.
        seed: the direction, shape (number of knowns,).

    Returns:
        The call; it gives the derivatives, shape (number of unknowns,).
    """
    direction = np.zeros(knowns.total)
    direction[knowns.positions] = seed
    references = [[v.valueReference for v in spread.variables] for spread in (unknowns, knowns)]
    more = {"nSensitivity": unknowns.total} if any(v.shape for v in unknowns.variables) else {}
    call = slave.getDirectionalDerivative
    return lambda: np.array(call(*references, direction.tolist(), **more))[unknowns.positions]
