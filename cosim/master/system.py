"""The coupled system: all components at one time, and one step of them together, with the balises on the way.

What controls the step knows only this: `advance` from one time to another, `save` and `restore` of everything.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cosim.balises.service import NO_ROWS, BaliseService, Row
from cosim.coupling.plan import Plan
from cosim.errors import CouplingError
from cosim.master.algorithms.algorithm import Algorithm

__all__ = ["NO_ROWS", "Checkpoint", "Row", "System"]


@dataclass
class Checkpoint:
    """Everything that a step changes, at one time.

    Args:
        states: of the components, in the order of the plan.
        values: shape (n,).
        balises: of the balise service, or None.
    """

    states: list[Any]
    values: np.ndarray
    balises: Any


class System:
    """All components of a plan, stepped together.

    Args:
        plan: prepared, components instantiated.
        algorithm: how they are brought over a step.
        balises: balise service, or None.
    """

    def __init__(self, plan: Plan, algorithm: Algorithm, balises: BaliseService | None = None) -> None:
        self.plan, self.algorithm, self.balises = plan, algorithm, balises
        if balises is not None:
            balises.attach(plan)

    def advance(self, t: float, until: float) -> Sequence[Row]:
        """Bring everything from `t` to `until` [s].

        Returns:
            Event rows in ``(t, until]``: before and after each event; the row of `until` itself is the plan's values.

        Raises:
            RunError: a component failed.
        """
        if self.balises is None:
            self.algorithm.advance(t, until)
            return NO_ROWS
        self.balises.begin(t, until)
        self.algorithm.advance(t, until)
        return self.balises.rows()

    def demand_states(self, what: str) -> None:
        """All components must be able to save their state.

        Args:
            what: needs it, for the message.

        Raises:
            CouplingError: some cannot; they are named.
        """
        stateless = [s.component.name for s in self.plan.steps if not s.component.can_save]
        if stateless:
            raise CouplingError(f"{what} steps back, and these components cannot save their state: {', '.join(stateless)}.")

    def save(self) -> Checkpoint:
        """Everything, to be restored any number of times and released once."""
        states = [step.component.save() for step in self.plan.steps]
        return Checkpoint(states, self.plan.values.copy(), None if self.balises is None else self.balises.save())

    def restore(self, checkpoint: Checkpoint) -> None:
        """Return to a checkpoint."""
        for step, state in zip(self.plan.steps, checkpoint.states, strict=True):
            step.component.restore(state)
        self.plan.values[:] = checkpoint.values
        if self.balises is not None:
            self.balises.restore(checkpoint.balises)

    def release(self, checkpoint: Checkpoint) -> None:
        """Free a checkpoint."""
        for step, state in zip(self.plan.steps, checkpoint.states, strict=True):
            step.component.release(state)
