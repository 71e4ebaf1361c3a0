"""A co-simulation FMU as a model: a state goes in by a restart, a step is one doStep. Touches one instance."""

from __future__ import annotations

from collections.abc import Callable

from cosim.fmu_model.quick_restarts import prepared_restart, quicken_restarts
from cosim.fmu_model.sealed import FAR, Array, SealedModel
from fmus.check.instance import SlaveError
from fmus.fmi.ports import is_native


class CoSimulationModel(SealedModel):
    """A co-simulation FMU; arguments as for `SealedModel`."""

    way = "restart"
    _restart_quickly: Callable[[float, Array, Array], None] | None = None
    """The calls of a restart without what is between them, where their order is fixed."""

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

    def _restart(self, t: float, x: Array, u: Array) -> None:
        if self._restart_quickly is None:
            super()._restart(t, x, u)
        else:
            self._restart_quickly(t, x, u)

    def _enter(self, t: float) -> None:
        self.instance.enter_initialization(t, t + FAR)
        self.instance.exit_initialization()

    def _quicken(self) -> None:
        instance, self._restart_quickly = self.instance, None
        if is_native(instance.slave):
            quicken_restarts(instance.slave, instance.fmi_version)
            if not instance.has_event_mode:  # else initialisation ends in calls that depend on what the FMU answers
                self._restart_quickly = prepared_restart(instance, self._write_point, FAR)
