"""Multirate: a component that steps at an integer fraction of the communication rate, or at a multiple of it.

A slow component is stepped last: when its own step is over it has the newest inputs, and its values are never from the
future. In between they are held. A fast component takes several steps for one of the master's; lines give each of them
its own inputs.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from cosim.coupling.chain import Mover, Position, Preparer, Stage, around
from cosim.coupling.plan import Plan
from cosim.coupling.planned import PlannedComponent
from cosim.errors import CouplingError
from cosim.master.axis import TimeAxis
from fmus.fmi.standard import TIME_TOLERANCE


class _SlowRate:
    """The stage at `Position.RATE`: steps a component over every n-th communication point only.

    Args:
        planned: the component.
        every: number of communication steps that make one of its own.
        axis: communication points; at the last one it is stepped whatever is left.
    """

    def __init__(self, planned: PlannedComponent, every: int, axis: TimeAxis) -> None:
        self._component, self._every, self._axis = planned.component, every, axis
        prepare = partial(partial, self._prepare)
        planned.add_stage(Stage(Position.RATE, rate_stage_text(every), prepare=prepare, move=around(self._move)))
        planned.continuous[:], planned.every = False, every

    def _prepare(self, inner: Preparer, t: float, until: float, *, ends_known: bool | np.ndarray = False) -> None:
        """Gather the inputs at the end of its own step only: until then the last ones hold."""
        if self._is_due(until):
            inner(self._component.time, until, ends_known=ends_known)

    def _move(self, inner: Mover, t: float, until: float) -> None:
        """Take its own step where it is over at `until` [s]."""
        if self._is_due(until):
            inner(self._component.time, until)

    def _is_due(self, until: float) -> bool:
        axis = self._axis
        k = round((until - axis.start) / axis.step)
        on_grid = abs(axis[k] - until) <= TIME_TOLERANCE
        return on_grid and (k % self._every == 0 or k == axis.count)


def rate_stage_text(every: int) -> str:
    """The stage of a component that is stepped every n-th communication step, in words."""
    return f"1 step for {every} communication steps"


def set_rates(
    plan: Plan, axis: TimeAxis, every: Mapping[str, int], substeps: Mapping[str, int], taken: Mapping[str, str]
) -> None:
    """Give components of a plan their own rates.

    Args:
        plan: prepared, services attached. axis: communication points.
        every: component -> communication steps that make one of its own.
        substeps: component -> own steps in one communication step.
        taken: component -> why it must take every communication step (it is watched, or receives balises).

    Raises:
        CouplingError: a component that must take every step, cannot vary its step where a rest is left, or has both
        rates.
    """
    for name, count in substeps.items():
        plan.find(name).divide(count)
    for name, count in every.items():
        if count == 1:
            continue
        planned = plan.find(name)
        if substeps.get(name, 1) != 1:
            raise CouplingError(f"{name}: 'every' and 'substeps' exclude each other; give one of them.")
        if name in taken:
            raise CouplingError(f"{name}: every = {count} is not possible: {taken[name]}.")
        if axis.count % count and not planned.component.can_vary_step:
            raise CouplingError(
                f"{name}: every = {count} does not divide the {axis.count} steps of the run, and the component cannot "
                f"vary its "
                "step for the rest; change 'stop', 'step' or 'every'."
            )
        _SlowRate(planned, count, axis)
