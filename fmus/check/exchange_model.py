"""Models: an FMU for model exchange driven under test: modes, continuous states, derivatives."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from fmpy.model_description import ModelDescription

from fmus.check.checked_instance import FmuInstance
from fmus.exchange.motion import Motion, motion_of
from fmus.fmi.fmi2 import FMI2Instance
from fmus.fmi.fmi3 import FMI3Instance
from fmus.fmi.standard import MODEL_EXCHANGE, fmi_version

_TOLERANCE = 1e-10
"""Relative, of the solver: far below what a filter or a difference shows."""


class FmuModel(FmuInstance):
    """A model exchange instance, from `instantiate` over `initialize` to continuous-time mode."""

    interface = MODEL_EXCHANGE

    @cached_property
    def motion(self) -> Motion:
        """What moves it, from one reset to the next."""
        return motion_of(self.slave, self.description, self.slave._functions, _TOLERANCE)

    @property
    def next_event(self) -> float:
        """The next instant at which the FMU wants Event Mode [s]."""
        return float(self.motion.next_event)

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
        self.guard("preparing the solver", lambda: self.motion).begin()
        self.settle()

    def settle(self) -> None:
        """From Event Mode to continuous-time mode, once the discrete states do not change any more."""
        self.guard("event iteration", self.motion.settle)
        self.terminated = self.motion.terminated

    def enter_event_mode(self) -> None:
        """To Event Mode, as before an input that jumps."""
        self.guard("enterEventMode", self.motion.enter_event_mode)

    def advance(self, t: float, until: float) -> None:
        """Integrate, events on the way handled.

        Args:
            t, until: begin and end [s].
        """
        end = self.guard("the step", self.motion.step, t, until)
        self.terminated = end.terminate
        if end.terminate:
            raise self.failure("it asks for the end of the simulation", end.time)

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
        self.motion.begin_anew()
        self.guard("setContinuousStates", lambda: self.slave.setContinuousStates(_pointer(held), len(held)))

    def derivatives(self) -> np.ndarray:
        """Derivatives of the continuous states, shape (n,)."""
        call = self.slave.getDerivatives if self.fmi_version == 2 else self.slave.getContinuousStateDerivatives
        return self._filled("getting derivatives", call, self.state_count)

    def indicators(self) -> np.ndarray:
        """Event indicators, shape (number of them,)."""
        return self._filled("getEventIndicators", self.slave.getEventIndicators, self.indicator_count)

    def _remember(self) -> tuple[Any, ...]:
        return self.terminated, self.motion.state()

    def _recall(self, remembered: tuple[Any, ...]) -> None:
        self.terminated = remembered[0]
        self.motion.restore(remembered[1])

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
