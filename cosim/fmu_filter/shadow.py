"""A run of the FMU that nobody disturbs, beside a filter that starts it again at each step: what the states do not
hold, such as a mode that is entered on the way and stays, shows in the difference.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cosim.fmu_filter.many import Saved
from cosim.fmu_model.sealed import Array, SealedModel
from cosim.fmu_model.trust import demand_continued

EVERY = 10
"""Steps from one comparison to the next: what stays is found by the next one, and a comparison costs a restart."""


class Shadow:
    """An instance that follows the inputs of a filter from its start, and is compared with a restart now and then.

    Args:
        own: the instance, at no time yet. restarted: another one of the same FMU, which anybody may start again.
    """

    def __init__(self, own: SealedModel, restarted: SealedModel) -> None:
        self._own, self._restarted = own, restarted
        self._count, self._change = 0, np.zeros(len(own.states) + len(own.outputs))
        self._begun = False
        self._compared = np.zeros(len(self._change))
        """States and outputs at the last comparison, shape (n + q,)."""

    def follow(self, t: float, h: float, u: Array) -> None:
        """Make the step of the filter, without its corrections.

        Args:
            t: begin [s]. h: length [s]. u: inputs, held, shape (m,).

        Raises:
            FmuModelError: the FMU refuses, or goes on otherwise from its states than in this run.
        """
        own = self._own
        if not self._begun:
            self._begun = True
            own.restart(t, own.start, u)
            self._compared = np.concatenate(own.read())
        self._count += 1
        before = own.read() if self._count % EVERY == 0 else None
        own.set_inputs(u)
        own.advance(t, h)
        if before is not None:
            self._compare(t, h, u, before)

    def _compare(self, t: float, h: float, u: Array, before: tuple[Array, Array]) -> None:
        """The step that was made with the same one from a restart. `before`: states and outputs where it began."""
        run = np.concatenate(self._own.read())
        over_step, on_average = np.abs(run - np.concatenate(before)), np.abs(run - self._compared) / EVERY
        self._change, self._compared = np.max([self._change, over_step, on_average], axis=0), run
        redone = self._restarted.transition(t, h, before[0], u)
        demand_continued(self._own, run, np.concatenate(redone), self._change, t + h)

    def state(self) -> Any:
        """What to keep in order to return here; None where the FMU does not save its state."""
        if not self._own.instance.can_save:
            return None
        saved = Saved(self._own.instance) if self._begun else None
        return saved, self._count, self._change, self._compared

    def restore(self, state: Any) -> bool:
        """Return, where that can be.

        Args:
            state: from `state`.

        Returns:
            Whether it did: not to a state that was not saved, or that is of another instance.
        """
        if state is None:
            return False
        saved, self._count, self._change, self._compared = state
        self._begun = saved is not None
        if saved is None:
            return True
        if saved.instance is not self._own.instance:
            return False
        self._own.called(lambda: self._own.instance.restore(saved.state))
        return True
