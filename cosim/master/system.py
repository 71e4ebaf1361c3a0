"""The coupled system: all components at one time, and one step of them together, with the balises on the way.

What controls the step knows only this: `advance` from one time to another, `save` and `restore` of everything.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence, Set
from dataclasses import dataclass
from typing import Any

import numpy as np

from cosim.balises.service import NO_ROWS, BaliseService, Row
from cosim.coupling.plan import Plan
from cosim.errors import CouplingError
from cosim.master.algorithms.algorithm import Algorithm
from cosim.master.algorithms.links import downstream
from cosim.network.service import NetworkService

__all__ = ["NO_ROWS", "Checkpoint", "Row", "System"]

Shortcut = Callable[[float, float], Sequence[Row] | None]


@dataclass
class Checkpoint:
    """Everything that a step changes, at one time.

    Args:
        states: of the components, in the order of the plan.
        values: shape (n,).
        interpolators: states of the input interpolators, in the order of the plan; None where a component has none.
        balises: of the balise service, or None.
        non_numeric: the values that are no doubles, shape (m,).
        algorithm: what the algorithm remembers, or None.
        network: what the network remembers, or None.
        events: what the coordinator remembers, or None.
    """

    states: list[Any]
    values: np.ndarray
    interpolators: list[Any]
    balises: Any
    non_numeric: np.ndarray
    algorithm: Any = None
    network: Any = None
    events: Any = None


class System:
    """All components of a plan, stepped together.

    Args:
        plan: prepared, components instantiated.
        algorithm: how they are brought over a step.
        balises: balise service, or None.
        network: over which measurements travel, or None.

    `shortcut` does what `move` does where nothing extraordinary is due, and returns None where it leaves that to it.
    """

    def __init__(
        self,
        plan: Plan,
        algorithm: Algorithm,
        balises: BaliseService | None = None,
        network: NetworkService | None = None,
    ) -> None:
        self.plan, self.algorithm, self.balises, self.network = plan, algorithm, balises, network
        self.shortcut: Shortcut | None = None
        if balises is not None:
            balises.attach(plan)
        if network is not None:
            network.attach(plan, () if balises is None else balises.receivers)

    @property
    def meets_events(self) -> bool:
        """Whether a step is divided where a component meets an event that nobody knew of before it."""
        return False

    def advance(self, t: float, until: float) -> Sequence[Row]:
        """Bring everything from `t` to `until` [s].

        Returns:
            Event rows in ``(t, until]``: before and after each event; the row of `until` itself is the plan's values.

        Raises:
            RunError: a component failed.
        """
        return self.move(t, until)

    def move(self, t: float, until: float) -> Sequence[Row]:
        """Bring everything from `t` to `until` [s] without a stop; returns and raises as `advance`."""
        if self.shortcut is not None and (done := self.shortcut(t, until)) is not None:
            return done
        self.plan.begin_step()
        if self.balises is None:
            self.algorithm.advance(t, until)
            return NO_ROWS
        self.balises.begin(t, until)
        self.algorithm.advance(t, until)
        rows = self.balises.rows()
        if self.balises.notified:
            self._restart_interpolation_from(self.balises.notified, until)
        return rows

    def restart_interpolation(self, t: float, jumped: np.ndarray, stale: np.ndarray) -> None:
        """Lines of inputs do not lead over a jump at `t` [s].

        Args:
            jumped: values that jumped, shape (n,): the lines from them begin with what the plan holds now.
            stale: values that may follow suit only in the next step, shape (n,): their lines begin with that.
        """
        self.plan.begin_step()
        for step in self.plan.steps:
            if step.interpolator is None:
                continue
            step.interpolator.forget(jumped | stale)
            if jumped[step.inputs.sources].any():
                step.interpolator.prepare(t)
                step.interpolator.forget(stale & ~jumped)

    def _restart_interpolation_from(self, names: Collection[str], t: float) -> None:
        """The outputs of these components may have jumped on the way to `t` [s]."""
        if not self.plan.interpolators:
            return
        jumped = np.zeros(len(self.plan.values), dtype=bool)
        for name in names:
            jumped[self.plan.find(name).columns] = True
        self.restart_interpolation(t, jumped, downstream(self.plan, names))

    def demand_states(self, what: str) -> None:
        """All components must be able to save their state.

        Args:
            what: needs it, for the message.

        Raises:
            CouplingError: some cannot; they are named.
        """
        stateless = [s.component.name for s in self.plan.steps if not s.component.can_save]
        if stateless:
            raise CouplingError(
                f"{what} steps back, and these components cannot save their state: {', '.join(stateless)}."
            )

    def save(self, *, anyway: bool = False) -> Checkpoint:
        """Everything, to be restored any number of times and released once.

        Args:
            anyway: leave out components that cannot save their state.
        """
        states = [step.component.save() if step.component.can_save or not anyway else None for step in self.plan.steps]
        interpolators = [None if step.interpolator is None else step.interpolator.save() for step in self.plan.steps]
        balises = None if self.balises is None else self.balises.save()
        return Checkpoint(
            states,
            self.plan.values.copy(),
            interpolators,
            balises,
            self.plan.non_numeric.copy(),
            self.algorithm.save(),
            None if self.network is None else self.network.save(),
        )

    def restore(self, checkpoint: Checkpoint, keep: Set[str] = frozenset()) -> None:
        """Return to a checkpoint.

        Args:
            keep: components that stay as they are; so do those that the checkpoint leaves out.
        """
        stay = [
            step
            for step, state in zip(self.plan.steps, checkpoint.states, strict=True)
            if state is None or step.component.name in keep
        ]
        for step, state in zip(self.plan.steps, checkpoint.states, strict=True):
            if step not in stay:
                step.component.restore(state)
        for step, state in zip(self.plan.steps, checkpoint.interpolators, strict=True):
            if step.interpolator is not None:
                step.interpolator.restore(state)
        self.plan.values[:] = checkpoint.values
        self.plan.non_numeric[:] = checkpoint.non_numeric
        self.algorithm.restore(checkpoint.algorithm)
        if self.network is not None:
            self.network.restore(checkpoint.network)
        if self.balises is not None and self.balises.plant in [step.component.name for step in stay]:
            self.balises.restore_but_plant(checkpoint.balises)
        elif self.balises is not None:
            self.balises.restore(checkpoint.balises)
        for step in stay:
            step.read()

    def release(self, checkpoint: Checkpoint) -> None:
        """Free a checkpoint."""
        for step, state in zip(self.plan.steps, checkpoint.states, strict=True):
            if state is not None:
                step.component.release(state)
