"""A linearisation as an object of python-control. Loaded by those who convert: python-control takes a second."""

from __future__ import annotations

import control

from cosim.fmu_model.linearisation import Linearisation


def to_state_space(found: Linearisation) -> control.StateSpace:
    """The matrices of a linearisation as a ``StateSpace``, names kept.

    Args:
        found: the linearisation; one from step to step gives a discrete-time system.

    Raises:
        ValueError: there are no states, inputs or outputs, which a ``StateSpace`` needs.
    """
    names = {"states": list(found.states), "inputs": list(found.inputs), "outputs": list(found.outputs)}
    for what, some in names.items():
        if not some:
            raise ValueError(f"{found.name}: it has no {what}, and a StateSpace needs some; use A, B, C and D.")
    return control.StateSpace(found.A, found.B, found.C, found.D, found.step, name=found.name, **names)
