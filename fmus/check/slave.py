"""Slaves: an FMU for co-simulation driven under test: steps, early returns, event mode, discarded steps."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import fmi2Discard, fmi2Terminated

from fmus.check.instance import FmuInstance
from fmus.fmi.standard import CO_SIMULATION, FATAL, MAX_EVENT_ITERATIONS, MAX_RETURNS_PER_STEP, STATUS, TIME_TOLERANCE


@dataclass(frozen=True)
class RawStep:
    """What one call of doStep said.

    Args:
        status: FMI status by name.
        event: event handling is needed. terminate: the FMU asks for the end.
        reached: where it says it stands [s], NaN where it did the whole step.
    """

    status: str
    event: bool = False
    terminate: bool = False
    reached: float = math.nan

    @property
    def refused(self) -> bool:
        """Whether the step was not done."""
        return self.status not in STATUS[:2]


class FmuSlave(FmuInstance):
    """A co-simulation instance; see `fmus.check.steppable.Steppable`."""

    interface = CO_SIMULATION

    @property
    def can_vary_step(self) -> bool:
        """Whether it says that the communication step may vary."""
        return bool(self.declared.canHandleVariableCommunicationStepSize)

    @property
    def has_event_mode(self) -> bool:
        """Whether it declares event mode (FMI 3)."""
        return self.version == 3 and bool(self.declared.hasEventMode)

    @property
    def clocks(self) -> list[str]:
        """Names of its triggered input clocks."""
        return [
            v.name
            for v in self.description.modelVariables
            if v.type == "Clock" and v.causality == "input" and v.intervalVariability == "triggered"
        ]

    def enter_initialization(self, start_time: float, stop_time: float) -> None:
        """Begin initialisation; times in [s].

        Args:
            start_time: [s]. stop_time: [s], without effect.
        """
        self._next_event = math.inf
        self._enter_initialization(start_time, stop_time)

    def exit_initialization(self) -> None:
        """End initialisation, discrete states settled."""
        self.guarded("exitInitializationMode", self.slave.exitInitializationMode)
        self._running = True
        if self.has_event_mode:
            self._settle()

    def raw_step(self, t: float, h: float) -> RawStep:
        """One doStep from `t` by `h` [s] and nothing else; a refusal is returned, not raised.

        Raises:
            SlaveError: the call could not be made.
        """
        try:
            said = self._do_step(t, h)
        except FMICallException as error:
            self._alive = self._running = self._alive and error.status != FATAL
            return RawStep(STATUS[error.status] if error.status in range(len(STATUS)) else f"status {error.status}")
        except Exception as error:
            raise self.failure(f"doStep failed: {error}", t) from error
        if self.version == 2:
            return RawStep("ok")
        event, terminate, early, reached = said
        return RawStep("ok", bool(event), bool(terminate), float(reached) if early or terminate else math.nan)

    def advance(self, t: float, until: float) -> None:
        """Step from `t` to `until` [s], own time events on the way included.

        Raises:
            SlaveError: the FMU failed or did not get there.
        """
        for _ in range(MAX_RETURNS_PER_STEP):
            stop = self._next_event if t + TIME_TOLERANCE < self._next_event < until - TIME_TOLERANCE else until
            t = self._towards(t, stop)
            if self.terminated or until - t <= TIME_TOLERANCE:
                return
        raise self.failure(f"returned early {MAX_RETURNS_PER_STEP} times without reaching {until:g} s", t)

    def activate(self, clock: str) -> None:
        """Let a triggered input clock tick, with the values its clocked inputs have."""
        reference = self.variables[clock].valueReference
        self.guarded("enterEventMode", self.slave.enterEventMode)
        self.guarded(f"setClock of {clock}", lambda: self.slave.setClock([reference], [True]))
        self._settle()

    def save(self) -> Any:
        """The state."""
        return super().save(), self._next_event

    def restore(self, state: Any) -> None:
        """Return to a saved state."""
        super().restore(state[0])
        self._next_event = state[1]

    def release(self, state: Any) -> None:
        """Free a saved state."""
        super().release(state[0])

    def serialize(self, state: Any) -> bytes:
        """A saved state as bytes."""
        return super().serialize(state[0])

    def deserialize(self, content: bytes) -> Any:
        """A saved state from bytes; the next time event is the one known here."""
        return super().deserialize(content), self._next_event

    # -- internals --------------------------------------------------------------------------------------------------

    def _arguments(self) -> Mapping[str, Any]:
        early = bool(self.declared.mightReturnEarlyFromDoStep)
        return {"eventModeUsed": self.has_event_mode, "earlyReturnAllowed": early}

    def _do_step(self, t: float, h: float) -> Any:
        """noSetFMUStatePriorToCurrentPoint is false: states before this point will be restored."""
        return self.slave.doStep(t, h, noSetFMUStatePriorToCurrentPoint=False)

    def _towards(self, t: float, stop: float) -> float:
        said = self.raw_step(t, stop - t)
        if said.refused:
            if said.status == STATUS[fmi2Discard] and self.version == 2 and self._says_terminated():
                self.terminated = True
                return stop
            raise self.failure(f"doStep from {t:g} to {stop:g} s was refused with status {said.status}")
        self.terminated |= said.terminate
        reached = stop if math.isnan(said.reached) else said.reached
        if not t - TIME_TOLERANCE <= reached <= stop + TIME_TOLERANCE:
            raise self.failure(f"doStep from {t:g} to {stop:g} s says that it reached {reached!r} s")
        if self.has_event_mode and not self.terminated and (said.event or reached >= self._next_event - TIME_TOLERANCE):
            self.guarded("enterEventMode", self.slave.enterEventMode)
            self._settle()
        return reached

    def _says_terminated(self) -> bool:
        try:
            return bool(self.slave.getBooleanStatus(fmi2Terminated))
        except Exception:  # one that cannot say why it discarded a step has simply not terminated
            return False

    def _settle(self) -> None:
        for _ in range(MAX_EVENT_ITERATIONS):
            again, end, _, _, defined, at = self.guarded("updateDiscreteStates", self.slave.updateDiscreteStates)
            self.terminated |= bool(end)
            if not again:
                break
        else:
            raise self.failure(f"discrete states do not settle in {MAX_EVENT_ITERATIONS} updates")
        self._next_event = float(at) if defined else math.inf
        self.guarded("enterStepMode", self.slave.enterStepMode)
