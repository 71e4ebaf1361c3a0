"""Which derivatives a component takes and gives, told in words where it does not; the calls are in
`fmus.fmi.derivatives`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from cosim.errors import CouplingError
from fmus.fmi.derivatives import input_derivative_writer
from fmus.fmi.elements import described
from fmus.fmi.types import FLOATING_TYPES
from fmus.fmi.values import signs

if TYPE_CHECKING:
    from cosim.components.component import Component


def make_derivative_writer(component: Component, names: Sequence[str]) -> tuple[Callable[[], None], np.ndarray]:
    """A call of setRealInputDerivatives of first order, and the array of shape (len(names),) it writes from.

    Args:
        component: an instantiated slave of FMI 1 or 2.
        names: of real inputs.

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
    write = input_derivative_writer(component.slave, component.fmi_version, references, held)
    if turn is None:
        return write, buffer

    def turn_and_write() -> None:
        turn(buffer, held)
        write()

    return turn_and_write, buffer


def demand_derivatives(component: Component, *names: str) -> None:
    """Refuse a component without directional derivatives, and variables that have none.

    Args:
        component: whose they are.
        names: of unknowns and knowns.

    Raises:
        CouplingError: the slave does not declare them, or a variable is not real.
    """
    if component.fmi_version == 1 or not component.capabilities.providesDirectionalDerivatives:
        raise CouplingError(f"{component.name} gives no directional derivatives: it does not declare them.")
    for element in (element for name in names for element in component.elements(name)):
        if element.variable.type not in FLOATING_TYPES:
            raise CouplingError(
                f"{component.name}.{element.name} has no derivative: it is a {described(element.variable)}."
            )
