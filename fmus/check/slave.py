"""Slaves driven under test: co-simulation of FMI 2.0 and 3.0, with single steps whose refusal is an answer."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from fmpy.fmi1 import FMICallException
from fmpy.model_description import ModelDescription

from fmus.check.instance import FmuInstance
from fmus.fmi.fmi2 import FMI2Slave
from fmus.fmi.fmi3 import FMI3Slave
from fmus.fmi.slave import Slave
from fmus.fmi.standard import OK, STATUS, WARNING, fmi_version


@dataclass(frozen=True)
class RawStep:
    """What one call of doStep said.

    Args:
        status: FMI status by name.
        event: event handling is needed.
        terminate: the FMU asks for the end.
        reached: where it says it stands [s], NaN where it did the whole step.
    """

    status: str
    event: bool = False
    terminate: bool = False
    reached: float = math.nan

    @property
    def refused(self) -> bool:
        """Whether the step was not done."""
        return self.status not in {STATUS[OK], STATUS[WARNING]}


class FmuSlave(FmuInstance, Slave):
    """A co-simulation instance; arguments as for `FmuInstance`."""

    def raw_step(self, t: float, h: float) -> RawStep:
        """One doStep and nothing else; a refusal is returned, not raised.

        Args:
            t: from when [s].
            h: length [s].

        Raises:
            SlaveError: the call could not be made.
        """
        try:
            said = self._do_step(t, h)
        except FMICallException as error:
            self.explained("doStep", error)
            return RawStep(STATUS[error.status] if error.status in range(len(STATUS)) else f"status {error.status}")
        except self.mistakes:
            raise
        except Exception as error:
            raise self.explained("doStep", error, t) from error
        if said is None:
            return RawStep(STATUS[OK])
        event, terminate, early, reached = said
        return RawStep(STATUS[OK], bool(event), bool(terminate), float(reached) if early or terminate else math.nan)


class FmuSlave2(FmuSlave, FMI2Slave):
    """A co-simulation instance of FMI 2.0; arguments as for `FmuInstance`."""


class FmuSlave3(FmuSlave, FMI3Slave):
    """A co-simulation instance of FMI 3.0; arguments as for `FmuInstance`."""

    def activate(self, clock: str) -> None:
        """Let a triggered input clock tick, with the values its clocked inputs have.

        Args:
            clock: its name.
        """
        self.enter_event_mode()
        self.set_clocks([self.events[clock].trigger])
        self.settle()


def make_slave(
    folder: Path, description: ModelDescription, name: str = "checked", *, logging: bool = False
) -> FmuSlave:
    """A co-simulation instance of an unpacked FMU, not yet instantiated.

    Args:
        folder: where the FMU was unpacked.
        description: its model description.
        name: instance name.
        logging: whether the FMU is asked to log.

    Raises:
        SlaveError: the library cannot be loaded.
    """
    version = FmuSlave2 if fmi_version(description) == 2 else FmuSlave3
    return version(folder, description, name, logging=logging)
