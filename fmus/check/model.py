"""Models: an FMU for model exchange driven under test: modes, continuous states, derivatives."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np

from fmus.check.instance import FmuInstance
from fmus.fmi.standard import MAX_EVENT_ITERATIONS, MODEL_EXCHANGE


class FmuModel(FmuInstance):
    """A model exchange instance, from `instantiate` over `initialize` to continuous-time mode."""

    interface = MODEL_EXCHANGE

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
        self._enter_initialization(start_time, start_time + 1e6)
        self.guarded("exitInitializationMode", self.slave.exitInitializationMode)
        self._running = True
        update = self.slave.newDiscreteStates if self.version == 2 else self.slave.updateDiscreteStates
        for _ in range(MAX_EVENT_ITERATIONS):
            again, end, *_ = self.guarded("updating discrete states", update)
            self.terminated |= bool(end)
            if not again:
                break
        else:
            raise self.failure(f"discrete states do not settle in {MAX_EVENT_ITERATIONS} updates")
        self.guarded("enterContinuousTimeMode", self.slave.enterContinuousTimeMode)

    def set_time(self, t: float) -> None:
        """The independent variable [s].

        Args:
            t: time at which it happened [s].
        """
        self.guarded("setTime", lambda: self.slave.setTime(t))

    def states(self) -> np.ndarray:
        """Continuous states, shape (n,)."""
        return self._filled("getContinuousStates", self.slave.getContinuousStates, self.state_count)

    def set_states(self, x: np.ndarray) -> None:
        """Continuous states, shape (n,)."""
        held = np.ascontiguousarray(x, dtype=float)
        self.guarded("setContinuousStates", lambda: self.slave.setContinuousStates(_pointer(held), len(held)))

    def derivatives(self) -> np.ndarray:
        """Derivatives of the continuous states, shape (n,)."""
        call = self.slave.getDerivatives if self.version == 2 else self.slave.getContinuousStateDerivatives
        return self._filled("getting derivatives", call, self.state_count)

    def indicators(self) -> np.ndarray:
        """Event indicators, shape (number of them,)."""
        return self._filled("getEventIndicators", self.slave.getEventIndicators, self.indicator_count)

    def _filled(self, what: str, call: Callable[[Any, int], Any], count: int) -> np.ndarray:
        values = np.zeros(count)
        self.guarded(what, lambda: call(_pointer(values), count))
        return values


def _pointer(values: np.ndarray) -> Any:
    return values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
