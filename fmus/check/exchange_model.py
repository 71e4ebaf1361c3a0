"""Models: an FMU for model exchange driven under test: modes, continuous states, derivatives."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from fmpy.model_description import ModelDescription

from fmus.check.checked_instance import FmuInstance
from fmus.fmi.fmi2 import FMI2Instance
from fmus.fmi.fmi3 import FMI3Instance
from fmus.fmi.standard import MODEL_EXCHANGE, NEVER, fmi_version


class FmuModel(FmuInstance):
    """A model exchange instance, from `instantiate` over `initialize` to continuous-time mode."""

    interface = MODEL_EXCHANGE
    next_event = NEVER
    """The next instant at which the FMU wants Event Mode [s]."""

    @property
    def state_count(self) -> int:
        """Number of continuous states."""
        return int(self.description.numberOfContinuousStates or 0)

    @property
    def indicator_count(self) -> int:
        """Number of event indicators."""
        return int(self.description.numberOfEventIndicators or 0)

    def initialize(self, start_time: float) -> None:
        """Through initialisation and the first event iteration to continuous-time mode; `start_time` in [s]."""
        self.begin_initialization(start_time, start_time + 1e6)
        self.guard("exitInitializationMode", self.slave.exitInitializationMode)
        self._running = True
        self.settle()
        self.guard("enterContinuousTimeMode", self.slave.enterContinuousTimeMode)

    def set_time(self, t: float) -> None:
        """Set the independent variable.

        Args:
            t: [s].
        """
        self.guard("setTime", lambda: self.slave.setTime(t))

    def states(self) -> np.ndarray:
        """Continuous states, shape (n,)."""
        return self._filled("getContinuousStates", self.slave.getContinuousStates, self.state_count)

    def set_states(self, x: np.ndarray) -> None:
        """Set the continuous states.

        Args:
            x: shape (n,).
        """
        held = np.ascontiguousarray(x, dtype=float)
        self.guard("setContinuousStates", lambda: self.slave.setContinuousStates(_pointer(held), len(held)))

    def derivatives(self) -> np.ndarray:
        """Derivatives of the continuous states, shape (n,)."""
        call = self.slave.getDerivatives if self.fmi_version == 2 else self.slave.getContinuousStateDerivatives
        return self._filled("getting derivatives", call, self.state_count)

    def indicators(self) -> np.ndarray:
        """Event indicators, shape (number of them,)."""
        return self._filled("getEventIndicators", self.slave.getEventIndicators, self.indicator_count)

    def update_discrete_states(self) -> bool:
        """End a super-dense instant; True where the FMU needs another one."""
        update = self.slave.newDiscreteStates if self.fmi_version == 2 else self.slave.updateDiscreteStates
        again, end, _, _, defined, instant = self.guard("updating discrete states", update)
        self.terminated |= bool(end)
        self.next_event = float(instant) if defined else NEVER
        return bool(again)

    def _forget(self) -> None:
        self.next_event = NEVER

    def _remember(self) -> tuple[Any, ...]:
        return self.terminated, self.next_event

    def _recall(self, remembered: tuple[Any, ...]) -> None:
        self.terminated, self.next_event = remembered

    def _filled(self, what: str, call: Callable[[Any, int], Any], count: int) -> np.ndarray:
        values = np.zeros(count)
        self.guard(what, lambda: call(_pointer(values), count))
        return values


class FmuModel2(FmuModel, FMI2Instance):
    """A model exchange instance of FMI 2.0; arguments as for `FmuInstance`."""


class FmuModel3(FmuModel, FMI3Instance):
    """A model exchange instance of FMI 3.0; arguments as for `FmuInstance`."""


def make_model(folder: Path, description: ModelDescription, name: str) -> FmuModel:
    """A model exchange instance of an unpacked FMU, not yet instantiated.

    Args:
        folder: where the FMU was unpacked.
        description: its model description.
        name: instance name.

    Raises:
        SlaveError: the library cannot be loaded.
    """
    version = FmuModel2 if fmi_version(description) == 2 else FmuModel3
    return version(folder, description, name)


def _pointer(values: np.ndarray) -> Any:
    return values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
