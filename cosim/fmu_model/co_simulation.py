"""A co-simulation FMU as a model: a state goes in by a restart, a step is one doStep. Touches one instance."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import repeat

import numpy as np

from cosim.fmu_model.quick_points import Point, QuickPoints
from cosim.fmu_model.quick_restarts import quicken_restarts
from cosim.fmu_model.sealed import FAR, Array, SealedModel
from fmus.check.instance import SlaveError
from fmus.fmi.ports import is_native


class CoSimulationModel(SealedModel):
    """A co-simulation FMU; arguments as for `SealedModel`."""

    way = "restart"
    _quick = False
    """Whether the order of the calls is fixed, so that those of a point are prepared as one."""
    _quick_restart: Point
    _quick_step: Point
    _quick_look: Point

    def advance(self, t: float, h: float) -> None:
        """Go on by one communication step, inputs held.

        Args:
            t: instant [s]. h: how far [s].

        Raises:
            FmuModelError: the FMU refuses the step.
        """
        try:
            self.instance.advance(t, t + h)
        except SlaveError as error:
            raise self._in_words(error) from error

    def states_after(self, t: float, h: float, points: Array, u: Array) -> Array:  # noqa: D102 - see SealedModel
        if not self._quick:
            return super().states_after(t, h, points, u)
        found = np.empty((points.shape[1], len(self.states)))
        quick, states, read = self._quick_step, self._state_values, self._states_read
        self._input_values[:] = u if u.ndim == 1 else 0.0
        driven = repeat(None) if u.ndim == 1 else u.T
        try:
            for row, x, now in zip(found, points.T, driven, strict=False):
                states[:] = x
                if now is not None:
                    self._input_values[:] = now
                if not quick(t, h):
                    self._slowly(t, h, x)
                row[:] = read
        except SlaveError as error:
            raise self._in_words(error) from error
        return found.T

    def outputs_at(self, t: float, points: Array, u: Array, chosen: Sequence[int]) -> Array:  # noqa: D102 - see SealedModel
        if not self._quick:
            return super().outputs_at(t, points, u, chosen)
        found = np.empty((points.shape[1], len(self.outputs)))
        look, states, read = self._quick_look, self._state_values, self._outputs_read
        self._input_values[:] = u
        try:
            for row, x in zip(found, points.T, strict=True):
                states[:] = x
                look(t, 0.0)
                row[:] = read
        except SlaveError as error:
            raise self._in_words(error) from error
        return found.take(chosen, axis=1).T

    def _slowly(self, t: float, h: float, x: Array) -> None:
        """A step in the ordinary way from a state, shape (n,), with the inputs that were written last."""
        super()._restart(t, x, self._input_values.copy())
        self.advance(t, h)
        self._read_states()

    def _restart(self, t: float, x: Array, u: Array) -> None:
        if not self._quick:
            super()._restart(t, x, u)
            return
        self._state_values[:], self._input_values[:] = x, u
        self._quick_restart(t, 0.0)

    def _enter(self, t: float) -> None:
        self.instance.enter_initialization(t, t + FAR)
        self.instance.exit_initialization()

    def _quicken(self) -> None:
        instance = self.instance
        if not is_native(instance.slave):
            return
        quicken_restarts(instance.slave, instance.fmi_version)
        self._quick = not instance.has_event_mode
        if not self._quick:  # initialisation ends in calls that depend on what the FMU answers
            return
        quick = QuickPoints(instance, FAR, self._written, self._write_values)
        self._quick_restart = quick.point((), None, step=False)
        self._quick_step = quick.point(self.states, self._read_states, step=True)
        self._quick_look = quick.point(self.outputs, self._read_outputs, step=False)
