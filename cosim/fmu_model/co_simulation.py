"""A co-simulation FMU as a model: a state goes in by a restart, a step is one doStep. Touches one instance."""

from __future__ import annotations

from cosim.fmu_model.quick_restarts import quicken_restarts
from cosim.fmu_model.sealed import FAR, SealedModel
from fmus.fmi.ports import is_native


class CoSimulationModel(SealedModel):
    """A co-simulation FMU; arguments as for `SealedModel`."""

    way = "restart"

    def advance(self, t: float, h: float) -> None:
        """Go on by one communication step, inputs held.

        Args:
            t: instant [s]. h: how far [s].

        Raises:
            FmuModelError: the FMU refuses the step.
        """
        self.told(lambda: self.instance.advance(t, t + h))

    def _enter(self, t: float) -> None:
        self.instance.enter_initialization(t, t + FAR)
        self.instance.exit_initialization()

    def _quicken(self) -> None:
        if is_native(self.instance.slave):
            quicken_restarts(self.instance.slave, self.instance.fmi_version)
