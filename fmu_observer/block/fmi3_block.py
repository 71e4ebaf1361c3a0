"""The FMI 3 interface of a block: the calls of fmpy's `FMU3Slave`, event mode and triggered input clocks included."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from fmpy.fmi3 import FMU3Slave

from fmu_observer.block.block_variables import ALIVE, BlockError, Mode, Role
from fmu_observer.block.interface import FMI_WARNING, WARNINGS, FMIInterface, allowed_in, refused

INT32: tuple[Role, ...] = ("count", "integer_output", "outcome")
INT64: tuple[Role, ...] = ("policy",)


class FMI3Block(FMIInterface, FMU3Slave):
    """A hybrid system with the call surface of an FMI 3.0 co-simulation slave.

    An event: `enterEventMode`, `setClock`, payload and, where it happened earlier, ``<event>_time`` by `setFloat64`,
    `updateDiscreteStates`, `enterStepMode`; with ``announcement="counts"`` as in FMI 2, and event mode has nothing to
    do. A block on which `instantiate` was never called (fmpy's `simulate_fmu` does not) uses event mode as soon as its
    caller does. Arguments as for `FMIInterface`.
    """

    fmi_version = 3
    real_type = "Float64"
    _event_mode_used: bool | None = None  # None: `instantiate` was never called
    _early_return_allowed = False

    # -- life -------------------------------------------------------------------------------------------------------

    @refused
    def instantiate(
        self,
        visible: bool = False,
        loggingOn: bool = False,
        eventModeUsed: bool = False,
        earlyReturnAllowed: bool = False,
        logMessage: Any = None,
        intermediateUpdate: Any = None,
        requiredIntermediateVariables: Any = None,
    ) -> None:
        """Start values; `eventModeUsed` and `earlyReturnAllowed` as in FMI 3.

        Args:
            visible: without effect, there is nothing to see. loggingOn: whether the importer wants log messages.
            logMessage: called with what is wrong with events.
            intermediateUpdate: without effect: blocks call nobody within a step.
            requiredIntermediateVariables: without effect: blocks call nobody within a step.
        """
        self.instance.reset()
        self.instance.events.listener = (
            None if logMessage is None else lambda text: logMessage(None, FMI_WARNING, WARNINGS, text.encode())
        )
        self._event_mode_used = bool(eventModeUsed)
        self._early_return_allowed = bool(earlyReturnAllowed)

    @refused
    def setDebugLogging(self, loggingOn: bool, categories: Sequence[str]) -> None:
        """Nothing to switch: what is wrong is raised, or logged by Python's `logging`. Unknown categories are
        refused.

        Args:
            loggingOn: whether the importer wants log messages.
        """
        known = [category.name for category in self.model_description.logCategories]
        for name in categories:
            if name not in known:
                raise BlockError(f"there is no log category {name}; there are {', '.join(known)}.")

    @allowed_in("instantiated")
    def enterInitializationMode(
        self, tolerance: float | None = None, startTime: float = 0.0, stopTime: float | None = None
    ) -> None:
        """Begin initialisation at `startTime` [s].

        Args:
            tolerance: without effect: the integration step is a parameter.
            stopTime: end of the run [s], without effect.
        """
        self.instance.set_up(startTime)
        self.instance.mode = "initialization"

    # -- events -----------------------------------------------------------------------------------------------------

    @allowed_in("step")
    def enterEventMode(self) -> None:
        """From step mode to event mode."""
        if self._event_mode_used is False:
            raise BlockError("the block was instantiated with eventModeUsed = False.")
        self.instance.mode, self._event_mode_used = "event", True

    @allowed_in("event")
    def enterStepMode(self) -> None:
        """From event mode to step mode."""
        if self.instance.events.active:
            names = ", ".join(
                self.system.triggered_events[number].name for number in sorted(self.instance.events.active)
            )
            raise BlockError(f"clock {names} is active; call updateDiscreteStates first, or the event is lost.")
        self.instance.mode = "step"

    @allowed_in("event")
    def setClock(self, vr: Sequence[int], values: Sequence[bool]) -> None:
        """Activate triggered input clocks; the events happen in `updateDiscreteStates`."""
        active = self.instance.events.active
        for number, value in zip(list(map(self.instance.variables.clock_number, vr)), values, strict=True):
            (active.add if value else active.discard)(number)

    @allowed_in(*ALIVE)
    def getClock(self, vr: Sequence[int]) -> list[bool]:
        """Whether clocks are active."""
        return [self.instance.variables.clock_number(reference) in self.instance.events.active for reference in vr]

    @refused
    def updateDiscreteStates(self) -> tuple[bool, bool, bool, bool, bool, float]:
        """Let the active clocks tick, in declared order.

        Returns:
            (discreteStatesNeedUpdate, terminate, nominalsChanged, valuesChanged, nextEventTimeDefined, nextEventTime).
        """
        if self._event_mode_used is None and self.mode == "step":
            self.enterEventMode()
        if self.instance.mode != "event":
            self.instance.require("event")
        return False, False, False, self.instance.tick(), False, 0.0

    # -- time -------------------------------------------------------------------------------------------------------

    def doStep(
        self,
        currentCommunicationPoint: float,
        communicationStepSize: float,
        noSetFMUStatePriorToCurrentPoint: bool = True,
    ) -> tuple[bool, bool, bool, float]:
        """Advance by one communication step [s], or, where early return is allowed, to the first periodic instant
        inside it.

        Args:
            currentCommunicationPoint: start of the step [s]. communicationStepSize: its length [s], above zero.
            noSetFMUStatePriorToCurrentPoint: as in FMI: no state of an earlier time will be set.

        Returns:
            (eventHandlingNeeded, terminateSimulation, earlyReturn, lastSuccessfulTime).
        """
        try:
            early = self.instance.step(currentCommunicationPoint, communicationStepSize, self._early_return_allowed)
        except BlockError as error:
            raise self.refusal("doStep", error) from error.__cause__
        return False, False, early, self.instance.runtime.t

    # -- values -----------------------------------------------------------------------------------------------------

    @refused
    def getFloat64(self, vr: Sequence[int], nValues: int | None = None) -> list[float]:
        """Values of Float64 variables.

        Args:
            nValues: how many values are expected; None for one a reference.
        """
        return self.instance.get(vr)

    @refused
    def setFloat64(self, vr: Sequence[int], values: Sequence[float]) -> None:
        """Set Float64 variables."""
        self.instance.set(vr, values)

    @refused
    def getInt32(self, vr: Sequence[int], nValues: int | None = None) -> list[int]:
        """Values of event counts, integer outputs and counts of outcomes.

        Args:
            nValues: how many values are expected; None for one a reference.
        """
        return self.instance.get_whole(vr, INT32)

    @refused
    def setInt32(self, vr: Sequence[int], values: Sequence[int]) -> None:
        """Set event counts."""
        self.instance.set_whole(vr, values, INT32)

    @refused
    def getInt64(self, vr: Sequence[int], nValues: int | None = None) -> list[int]:
        """The number of the late policy.

        Args:
            nValues: how many values are expected; None for one a reference.
        """
        return self.instance.get_whole(vr, INT64)

    @refused
    def setInt64(self, vr: Sequence[int], values: Sequence[int]) -> None:
        """Set the late policy by its number."""
        self.instance.set_whole(vr, values, INT64)

    def fmi3SetFloat64(
        self, _component: object, vr: Iterable[int], _n: int, values: Iterable[float], _n_values: int
    ) -> None:
        """The low-level setter used by fmpy's `Input`."""
        self.setFloat64(list(vr), list(values))

    @refused
    def getDirectionalDerivative(
        self, unknowns: Sequence[int], knowns: Sequence[int], seed: Sequence[float], nSensitivity: int | None = None
    ) -> list[float]:
        """Directional derivatives of the unknowns by the knowns with this seed."""
        return self.directional_derivative(unknowns, knowns, seed)

    @refused
    def exitInitializationMode(self) -> None:
        """End initialisation; time begins to run. A warning where nobody will be able to announce the events of the
        block.
        """
        super().exitInitializationMode()
        if self._event_mode_used is False and self.system.triggered_events and not self._counts_events:
            names = ", ".join(event.name for event in self.system.triggered_events)
            self.instance.events.warn(
                "%s: eventModeUsed is False, but events (%s) are announced by clocks: none arrives; a block with "
                "announcement='counts' (an FMU built with `--events counts`) is for masters without event mode",
                self.instanceName,
                names,
            )

    # -- internals --------------------------------------------------------------------------------------------------

    def _mode_after_initialization(self) -> Mode:
        return "event" if self._event_mode_used else "step"
