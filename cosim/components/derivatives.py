"""Which derivatives a component takes and gives, with a reason where it does not; the calls are in
`fmus.fmi.derivatives`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from fmpy.model_description import ModelVariable

from cosim.components.described import DescribedComponent
from cosim.errors import CouplingError
from fmus.fmi.derivatives import input_derivative_writer
from fmus.fmi.elements import described
from fmus.fmi.instance import shown
from fmus.fmi.slave import Slave
from fmus.fmi.types import FLOATING_TYPES
from fmus.fmi.values import signs


class DifferentiableComponent(DescribedComponent, Slave):
    """A slave in the words of a scenario, with its derivatives."""

    def make_derivative_writer(self, names: Sequence[str]) -> tuple[Callable[[], None], np.ndarray]:
        """A call of setRealInputDerivatives of first order (FMI 1 and 2), and the array of shape (len(names),) it
        writes from. They hold for the coming step only.

        Args:
            names: of real inputs.

        Raises:
            CouplingError: the slave does not take derivatives (canInterpolateInputs), or a name is no continuous real
            input.
        """
        references, buffer = [v.valueReference for v in self._differentiable_inputs(names)], np.zeros(len(names))
        turn = signs(self, names)
        held = buffer if turn is None else np.zeros(len(names))
        write = input_derivative_writer(self.slave, self.fmi_version, references, held)

        def turn_and_write() -> None:
            assert turn is not None
            turn(buffer, held)
            write()

        return self.guarded(f"derivatives of {shown(names)}", write if turn is None else turn_and_write), buffer

    def derivative_call(
        self, unknowns: Sequence[str], knowns: Sequence[str], seed: Sequence[float]
    ) -> Callable[[], np.ndarray]:
        """As for `Instance`.

        Args:
            unknowns: outputs and the like.
            knowns: inputs and the like.
            seed: the direction, shape (len(knowns),).

        Raises:
            CouplingError: the slave does not declare providesDirectionalDerivatives, or a variable is not real.
        """
        if self.fmi_version == 1 or not self.capabilities.providesDirectionalDerivatives:
            raise CouplingError(f"{self.name} gives no directional derivatives: it does not declare them.")
        for element in (element for name in (*unknowns, *knowns) for element in self.elements(name)):
            if element.variable.type not in FLOATING_TYPES:
                raise CouplingError(
                    f"{self.name}.{element.name} has no derivative: it is a {described(element.variable)}."
                )
        return super().derivative_call(unknowns, knowns, seed)

    def _differentiable_inputs(self, names: Sequence[str]) -> list[ModelVariable]:
        if self.fmi_version == 3 or not self.capabilities.canInterpolateInputs:
            why = (
                "FMI 3 has no input derivatives"
                if self.fmi_version == 3
                else "it does not declare canInterpolateInputs"
            )
            raise CouplingError(f"{self.name} takes no derivatives of inputs: {why}.")
        variables = [self.variable(name, "input") for name in names]
        for variable in variables:
            if variable.type != "Real":
                raise CouplingError(f"{self.name}.{variable.name} has no derivative: it is a {described(variable)}.")
        return variables
