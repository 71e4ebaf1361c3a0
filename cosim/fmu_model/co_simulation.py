"""A co-simulation FMU as a model: a state goes in by a restart, a step is one doStep. Touches one instance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cosim.fmu_model.quick_points import Batch, QuickPoints
from cosim.fmu_model.quick_restarts import quicken_restarts
from cosim.fmu_model.sealed import FAR, Array, FmuModelError, SealedModel, Way
from fmus.check.checked_instance import SlaveError
from fmus.fmi.ports import is_native


class CoSimulationModel(SealedModel):
    """A co-simulation FMU; arguments as for `SealedModel`."""

    way: Way = "restart"
    _quick: QuickPoints | None = None
    """Restarts as one call each, where the order of the calls is fixed."""
    _steps: Batch
    _looks: Batch

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
        if self._quick is None or self._quick.hangs_in:
            return super().states_after(t, h, points, u)
        try:
            return self._steps(t, h, self._values_of(points, u), self._slowly).T
        except SlaveError as error:
            raise self._in_words(error) from error

    def outputs_at(self, t: float, points: Array, u: Array, chosen: Sequence[int] | None = None) -> Array:  # noqa: D102 - see SealedModel
        if self._quick is None or self._quick.hangs_in:
            return super().outputs_at(t, points, u, chosen)
        try:
            found = self._looks(t, 0.0, self._values_of(points, u), self._slowly)
        except SlaveError as error:
            raise self._in_words(error) from error
        return found.T if chosen is None else found.take(chosen, axis=1).T

    def _values_of(self, points: Array, u: Array) -> Array:
        """What is written before initialisation at points, shape (n, N), under inputs, shape (m,) or (m, N)."""
        first, last = len(self._settings), len(self._settings) + len(self.states)
        found = np.empty((points.shape[1], len(self._values)))
        found[:, :first], found[:, first:last], found[:, last:] = self._values[:first], points.T, u.T
        return found

    def _slowly(self, t: float, h: float, written: Array) -> Array:
        """States after a step in the ordinary way from what is written before initialisation, shape (k,)."""
        first, last = len(self._settings), len(self._settings) + len(self.states)
        super()._restart(t, written[first:last], written[last:])
        self.instance.advance(t, t + h)
        self._read_states()
        return self._states_read

    def _restart(self, t: float, x: Array, u: Array) -> None:
        if self._quick is not None:
            self._state_values[:], self._input_values[:] = x, u
            self._quick.restart(t)
            return
        super()._restart(t, x, u)
        if self.way == "step mode":
            self._late_states[:] = x
            self._write_late()

    def _enter(self, t: float) -> None:
        self.instance.enter_initialization(t, t + FAR)
        self.instance.exit_initialization()

    def _demand_settable(self) -> None:
        """States without start values are set in Step Mode after each restart, where the FMU takes them there."""
        stuck = [name for name in self.states if not self._has_start(name)]
        if not stuck:
            return
        self.way = "step mode"
        self._write_late, self._late_states = self.instance.writer(list(self.states))
        self._late_states[:] = self.start
        try:
            self._write_late()
        except SlaveError as error:
            variable = self.instance.variables.element(stuck[0]).variable
            raise FmuModelError(
                f"{self.path}: the state {stuck[0]!r} has no start value that can be set (causality "
                f"{variable.causality}, initial {variable.initial or 'not declared'}), and in Step Mode the FMU "
                f"refuses it ({str(error).rstrip('.')}), so no filter can move it. Name states whose start is exact, "
                "use the model exchange of the FMU where it has one, or a particle filter over saved states, which "
                "selects and moves nothing."
            ) from error

    def _quicken(self) -> None:
        instance = self.instance
        if not is_native(instance.slave):
            return
        quicken_restarts(instance.slave, instance.fmi_version)
        if instance.has_event_mode or self.way != "restart":
            return  # initialisation ends in calls that depend on what the FMU answers, or is followed by others
        self._quick = quick = QuickPoints(instance, FAR, self._written, self._write_values)
        self._steps, self._looks = quick.batch(self.states, step=True), quick.batch(self.outputs, step=False)
