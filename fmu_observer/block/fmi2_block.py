"""The FMI 2 interface of a block: the calls of fmpy's `FMU2Slave`, events by count, stamp and payload."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from fmpy.fmi2 import FMU2Slave, fmi2LastSuccessfulTime, fmi2Terminated

from fmu_observer.block.block_variables import BlockError, Role
from fmu_observer.block.interface import FMI_WARNING, WARNINGS, FMIInterface, allowed_in, refused

WHOLE: tuple[Role, ...] = ("count", "integer_output", "outcome", "policy")


class FMI2Block(FMIInterface, FMU2Slave):
    """A hybrid system with the call surface of an FMI 2.0 co-simulation slave.

    An event: set the payload, ``<event>_time`` (unset: the start of the step) and raise ``<event>_count`` by one before
    `doStep`; a stamp inside the step is hit exactly, one after it waits, one before it goes by the late policy.
    Arguments as for `FMIInterface`.
    """

    fmi_version = 2
    real_type = "Real"

    # -- life -------------------------------------------------------------------------------------------------------

    def instantiate(self, visible: bool = False, callbacks: Any = None, loggingOn: bool = False) -> None:
        """Start values; the logger among the callbacks hears what is wrong with events.

        Args:
            visible: without effect, there is nothing to see. loggingOn: whether the importer wants log messages.
        """
        self.instance.reset()
        logger: Any = getattr(callbacks, "logger", None)
        name = self.instanceName.encode()
        environment = getattr(callbacks, "componentEnvironment", None)

        def listener(text: str) -> None:
            # it takes what printf takes
            logger(environment, name, FMI_WARNING, WARNINGS, text.replace("%", "%%").encode())

        self.instance.events.listener = listener if logger else None

    @allowed_in("instantiated")
    def setupExperiment(
        self, tolerance: float | None = None, startTime: float = 0.0, stopTime: float | None = None
    ) -> None:
        """Fix the start time [s].

        Args:
            tolerance: without effect: the integration step is a parameter. startTime: [s].
            stopTime: end of the run [s], without effect.
        """
        self.instance.set_up(startTime)

    @allowed_in("instantiated")
    def enterInitializationMode(self) -> None:
        """Begin initialisation at the start time."""
        self.instance.mode = "initialization"

    # -- time -------------------------------------------------------------------------------------------------------

    def doStep(
        self,
        currentCommunicationPoint: float,
        communicationStepSize: float,
        noSetFMUStatePriorToCurrentPoint: bool = True,
    ) -> None:
        """Advance by one communication step [s], through the events announced since the last one.

        Args:
            currentCommunicationPoint: start of the step [s]. communicationStepSize: its length [s], above zero.
            noSetFMUStatePriorToCurrentPoint: as in FMI: no state of an earlier time will be set.
        """
        try:
            self.instance.step(currentCommunicationPoint, communicationStepSize)
        except BlockError as error:
            raise self.refusal("doStep", error) from error.__cause__

    def cancelStep(self) -> None:
        """Nothing to cancel: steps are synchronous."""

    @refused
    def getRealStatus(self, kind: int) -> float:
        """The last successful time [s].

        Args:
            kind: FMI's number of the status.
        """
        _require_status(kind, fmi2LastSuccessfulTime, "a real one; only fmi2LastSuccessfulTime")
        return self.instance.runtime.t

    @refused
    def getBooleanStatus(self, kind: int) -> bool:
        """Whether the run should end: after a discarded step, until one succeeds.

        Args:
            kind: FMI's number of the status.
        """
        _require_status(kind, fmi2Terminated, "a Boolean one; only fmi2Terminated")
        return self.instance.discarded

    # -- values -----------------------------------------------------------------------------------------------------

    @refused
    def getReal(self, vr: Sequence[int]) -> list[float]:
        """Values of Real variables."""
        return self.instance.get(vr)

    @refused
    def setReal(self, vr: Sequence[int], value: Sequence[float]) -> None:
        """Set Real variables."""
        self.instance.set(vr, value)

    @refused
    def getInteger(self, vr: Sequence[int]) -> list[int]:
        """Values of event counts, integer outputs, counts of outcomes and the late policy."""
        return self.instance.get_whole(vr, WHOLE)

    @refused
    def setInteger(self, vr: Sequence[int], value: Sequence[int]) -> None:
        """Set event counts, or the late policy."""
        self.instance.set_whole(vr, value, WHOLE)

    def fmi2SetReal(self, _component: object, vr: Iterable[int], _n: int, values: Iterable[float]) -> None:
        """The low-level setter used by fmpy's `Input`."""
        self.setReal(list(vr), list(values))

    def fmi2SetInteger(self, _component: object, vr: Iterable[int], _n: int, values: Iterable[int]) -> None:
        """The low-level setter used by fmpy's `Input`."""
        self.setInteger(list(vr), list(values))

    @refused
    def getDirectionalDerivative(
        self, vUnknown_ref: Sequence[int], vKnown_ref: Sequence[int], dvKnown: Sequence[float]
    ) -> list[float]:
        """Directional derivatives of the unknowns by the knowns with the seed `dvKnown`."""
        return self.directional_derivative(vUnknown_ref, vKnown_ref, dvKnown)

    def getTypesPlatform(self) -> str:
        """Platform of the types."""
        return "default"

    # -- saved states: FMI 2 spells them so; fmpy knows both spellings ------------------------------------------------

    getFMUstate = FMIInterface.getFMUState
    setFMUstate = FMIInterface.setFMUState
    freeFMUstate = FMIInterface.freeFMUState
    serializeFMUstate = FMIInterface.serializeFMUState
    deSerializeFMUstate = FMIInterface.deserializeFMUState


def _require_status(kind: int, known: int, what: str) -> None:
    if kind != known:
        raise BlockError(f"status {kind} is not {what} is known.")
