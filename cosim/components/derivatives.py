"""Derivatives that slaves take and give: of inputs in time (FMI 1, 2), and directional derivatives (FMI 2, 3)."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from cosim.errors import CouplingError
from fmus.fmi.elements import Layout, described, layout
from fmus.fmi.ports import is_native
from fmus.fmi.types import FLOATING_TYPES
from fmus.fmi.values import signs

if TYPE_CHECKING:
    from cosim.components.component import Component


def make_derivative_writer(component: Component, names: Sequence[str]) -> tuple[Callable[[], None], np.ndarray]:
    """A call of setRealInputDerivatives of first order, and the array of shape (len(names),) it tells from.

    Args:
        component: an instantiated slave of FMI 1 or 2. names: of real inputs.

    Raises:
        CouplingError: the slave does not take derivatives, or a name is no real input.
    """
    if component.fmi_version == 3 or not component.capabilities.canInterpolateInputs:
        why = (
            "FMI 3 has no input derivatives"
            if component.fmi_version == 3
            else "it does not declare canInterpolateInputs"
        )
        raise CouplingError(f"{component.name} takes no derivatives of inputs: {why}.")
    variables = [component.variable(name, "input") for name in names]
    for variable in variables:
        if variable.type != "Real":
            raise CouplingError(f"{component.name}.{variable.name} has no derivative: it is a {described(variable)}.")
    references, buffer = [v.valueReference for v in variables], np.zeros(len(names))
    turn = signs(component, names)
    held = buffer if turn is None else np.zeros(len(names))
    make = _native_teller if is_native(component.slave) else _teller
    tell = make(component, references, held)
    if turn is None:
        return tell, buffer

    def turn_and_tell() -> None:
        turn(buffer, held)
        tell()

    return turn_and_tell, buffer


def _native_teller(component: Component, references: Sequence[int], values: np.ndarray) -> Callable[[], None]:
    count = len(references)
    call = getattr(component.slave, f"fmi{component.fmi_version}SetRealInputDerivatives")
    pointer = values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
    orders = (ctypes.c_int * count)(*[1] * count)
    arguments = (component.slave.component, (ctypes.c_uint32 * count)(*references), count, orders, pointer)

    def tell() -> None:
        call(*arguments)

    return tell


def _teller(component: Component, references: Sequence[int], values: np.ndarray) -> Callable[[], None]:
    call, orders = component.slave.setRealInputDerivatives, [1] * len(references)
    return lambda: call(list(references), orders, values.tolist())


def directional_derivative(
    component: Component, unknowns: Sequence[str], knowns: Sequence[str], seed: Sequence[float]
) -> Callable[[], np.ndarray]:
    """A call of getDirectionalDerivative; arguments as for `Component.directional_derivative`.

    Raises:
        CouplingError: the slave does not declare it, or a variable is not real.
    """
    if component.fmi_version == 1 or not component.capabilities.providesDirectionalDerivatives:
        raise CouplingError(f"{component.name} gives no directional derivatives: it does not declare them.")
    targets, sources = _real(component, unknowns), _real(component, knowns)
    direction = np.zeros(sources.total)
    direction[sources.positions] = seed
    references = [[v.valueReference for v in spread.variables] for spread in (targets, sources)]
    more = {"nSensitivity": targets.total} if any(v.shape for v in targets.variables) else {}
    call = component.slave.getDirectionalDerivative
    return lambda: np.array(call(*references, direction.tolist(), **more))[targets.positions]


def _real(component: Component, names: Sequence[str]) -> Layout:
    elements = [element for name in names for element in component.elements(name)]
    for element in elements:
        if element.variable.type not in FLOATING_TYPES:
            raise CouplingError(
                f"{component.name}.{element.name} has no derivative: it is a {described(element.variable)}."
            )
    return layout(elements)
