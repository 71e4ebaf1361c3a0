"""A planned component: one component with its part of the plan, and the chain of stages through which it moves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from cosim.components.component import Component
from cosim.coupling.chain import Mover, Position, Preparer, Stage, plain_way
from cosim.coupling.inputs import Inputs


class PlannedInterpolator(Protocol):
    """Lets inputs follow a line during a step (`cosim.master.interpolation`)."""

    @property
    def name(self) -> str:
        """How the component is notified."""

    def begin(self) -> None:
        """A step begins: what is held over it was true where its source stands now."""

    def prepare(self, until: float, *, ends_known: bool | np.ndarray = False) -> None:
        """Gather the inputs for a step to `until` [s].

        Args:
            ends_known: for which inputs the value at the end of the step is known.
        """

    def send(self, t: float, until: float) -> None:
        """Give the line for a step from `t` to `until` [s]."""

    def arrive(self, until: float) -> None:
        """The component stands at `until` [s], the end of a step."""

    def forget(self, jumped: np.ndarray) -> None:
        """Values of the plan that jumped, as a mask of shape (n,): no line of an input leads over it."""

    def save(self) -> Any:
        """What a step changes."""

    def restore(self, state: Any) -> None:
        """Return to what was saved.

        Args:
            state: as `save_within` or `save` gave it.
        """


@dataclass
class PlannedComponent:
    """One component in the plan.

    Args:
        component: what is stepped.
        outputs: slice of `values` with its outputs, a view of shape (q,).
        read: reads the outputs into `values`.
        inputs: its connected inputs.
        columns: where the view lies in `values`.
        continuous: mask of the outputs that may be interpolated between communication points, shape (q,).
        interpolator: gives the component the course of its inputs over a step; None where they are held.
        substeps: number of steps that the component takes for one of the master's.
        every: number of the master's steps that make one of the component's.

    The calls that move it are the plain ones with the `stages` around them, outermost first:

    - ``prepare(t, until, ends_known=...)`` gathers the inputs for a step from `t` to `until` [s]. `ends_known` says
      that `values` are those of `until`, wherever the components stand (a step that is iterated); for all inputs or
      for each, shape (m,).
    - ``move(t, until)`` brings it there through all stages.
    - ``drive(t, until)`` does so without the balise service: sends the prepared inputs, advances, reads the outputs.
    - ``advance(t, until)`` does not read the outputs.

    `taken_over` says that `move` is more than `drive`.
    """

    component: Component
    outputs: np.ndarray
    read: Callable[[], None]
    inputs: Inputs
    columns: slice
    continuous: np.ndarray
    interpolator: PlannedInterpolator | None = field(default=None, init=False)
    substeps: int = field(default=1, init=False)
    every: int = field(default=1, init=False)
    stages: tuple[Stage, ...] = field(default=(), init=False)
    prepare: Preparer = field(init=False, repr=False)
    move: Mover = field(init=False, repr=False)
    drive: Mover = field(init=False, repr=False)
    advance: Mover = field(init=False, repr=False)
    taken_over: bool = field(default=False, init=False)

    def __post_init__(self) -> None:
        self._link()

    def add_stage(self, stage: Stage) -> None:
        """Put a stage into its place in the chain.

        Args:
            stage: replaces the one at its position, where the plan is given to another master.
        """
        others = [known for known in self.stages if known.position is not stage.position]
        self.stages = tuple(sorted((*others, stage), key=lambda known: known.position))
        self._link()

    def divide(self, substeps: int) -> None:
        """Advance in so many steps of its own for each step.

        Args:
            substeps: how many.
        """
        self.substeps = substeps
        self._link()

    def chain(self) -> tuple[str, ...]:
        """How it moves, in words: the stages, outermost first, then the plain way."""
        name = None if self.interpolator is None else self.interpolator.name
        inputs = len(self.inputs) > 0 or self.inputs.non_numeric is not None
        plain = plain_way(name, self.substeps, inputs=inputs, gated=self.inputs.gated)
        return *(stage.text for stage in self.stages), plain

    def send(self, t: float, until: float) -> None:
        """Send the prepared inputs for a step from `t` to `until` [s]."""
        if self.interpolator is None:
            self.inputs.send()
        else:
            self.interpolator.send(t, until)

    def write(self) -> None:
        """Send what the sources of the connected inputs say now."""
        self.inputs.gather_now()
        self.inputs.send()

    def step(self, t: float, until: float) -> None:
        """Prepare the inputs and move from `t` to `until` [s]."""
        self.prepare(t, until)
        self.move(t, until)

    # -- the chain --------------------------------------------------------------------------------------------------

    def _link(self) -> None:
        self.prepare, self.drive = self._prepare, self._drive
        self.advance = self._go if self.substeps == 1 else self._advance
        for stage in reversed(self.stages):
            self.prepare = stage.prepare(self.prepare)
            self.drive, self.advance = stage.drive(self.drive), stage.advance(self.advance)
        self.move = self.drive
        for stage in reversed(self.stages):
            self.move = stage.move(self.move)
        self.taken_over = any(stage.position is not Position.COMPILED for stage in self.stages)

    def _prepare(self, t: float, until: float, *, ends_known: bool | np.ndarray = False) -> None:
        if self.interpolator is None:
            self.inputs.gather()
        else:
            self.interpolator.prepare(until, ends_known=ends_known)

    def _advance(self, t: float, until: float) -> None:
        """In so many steps as the component wants."""
        begin = t
        for i in range(1, self.substeps + 1):
            end = until if i == self.substeps else t + (until - t) * i / self.substeps
            self._go(begin, end)
            if self.component.terminated:
                return
            begin = end

    def _go(self, t: float, until: float) -> None:
        if self.interpolator is None:
            self.inputs.send()
            self.component.advance(t, until)
            return
        self.interpolator.send(t, until)
        self.component.advance(t, until)
        if not self.component.terminated:
            self.interpolator.arrive(until)

    def _drive(self, t: float, until: float) -> None:
        (self._go if self.substeps == 1 else self._advance)(t, until)
        self.read()
