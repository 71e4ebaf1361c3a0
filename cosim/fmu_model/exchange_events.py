"""Integration of a model exchange instance from event to event: indicators that change their sign, instants that the
FMU announced, and steps after which it asks for Event Mode. Touches one instance.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy

from cosim.fmu_model.sealed import Array, FmuModelError, SealedModel

TOLERANCE = 1e-10
"""Relative and absolute, of the integration: far below what a filter or a difference shows."""
INSTANT = 1e-12
"""Width to which the instant of an event is found, relative to the time and at least so many seconds."""
MOST_EVENTS = 100
"""In one step of a filter; more is a state that chatters, or a ball that bounces faster and faster."""


class ContinuousModel(SealedModel):
    """A model exchange FMU in Continuous-Time Mode; arguments as for `SealedModel`."""

    def derivatives(self) -> Array:
        """Derivatives of the states where the instance stands, shape (n,)."""
        found: Array = self.called(self.instance.derivatives)
        return found

    def move(self, t: float, x: Array, u: Array) -> None:
        """Set time, states and inputs: no event is looked for.

        Args:
            t: instant [s]. x: states, shape (n,). u: inputs, shape (m,).
        """

        def move() -> None:
            self.instance.set_time(t)
            self.instance.set_states(x)
            if len(self.inputs):
                self._inputs[:] = u
                self._write_inputs()

        self.called(move)


class EventRun:
    """Steps of a model exchange FMU with the events on their way.

    Args:
        model: the FMU, instantiated.
    """

    def __init__(self, model: ContinuousModel) -> None:
        self._model, self._instance = model, model.instance
        self._indicators = self._instance.indicator_count > 0
        self._completes = not getattr(self._instance.capabilities, "completedIntegratorStepNotNeeded", False)

    def signs(self) -> Array:
        """Which event indicators are positive where the instance stands, shape (number of them,)."""
        if not self._indicators:
            return np.zeros(0, dtype=bool)
        return np.asarray(self._model.called(self._instance.indicators) > 0.0)

    def advance(self, t: float, h: float, x: Array, u: Array) -> None:
        """Integrate from a state to the end of a step, inputs held, and leave the instance there.

        Args:
            t: begin [s]. h: length [s]. x: states, shape (n,). u: inputs, shape (m,).

        Raises:
            FmuModelError: the FMU refuses, asks for the end, or has more events than can be.
        """
        begin, end, why = t, t + h, "nothing"
        for _ in range(MOST_EVENTS):
            stop = min(end, self._instance.next_event)
            event = ""
            if stop - t > self._width(t):
                t, x, event = self._until_event(t, stop, x, u)
            if not event and self._instance.next_event <= t + self._width(t):
                event = "an instant that the FMU announced"
            if not event:
                self._model.move(end, x, u)
                return
            why = event
            x = self._handled(t, x, u, event)
            if end - t <= self._width(t):
                return
        raise FmuModelError(
            f"{self._model.path}: {MOST_EVENTS} events between t = {begin:g} s and {t:.9g} s, the last of them {why}: "
            "a state of it chatters. Use its co-simulation where it has one, or a shorter step."
        )

    def _until_event(self, t: float, stop: float, x: Array, u: Array) -> tuple[float, Array, str]:
        """To the first event, or to an instant [s]: where and at what states it stands, and which event, else ''."""
        model = self._model
        model.move(t, x, u)
        before = self.signs()

        def rates(instant: float, at: Array) -> Array:
            model.move(instant, at, u)
            return model.derivatives()

        solution = integrated(model.path, rates, t, stop, x, dense=self._indicators)
        for i in range(1, len(solution.t)):
            instant, at = float(solution.t[i]), solution.y[:, i]
            model.move(instant, at, u)
            if self._indicators and (self.signs() != before).any():
                instant = self._found(float(solution.t[i - 1]), instant, before, solution.sol, u)
                at = solution.sol(instant)
                model.move(instant, at, u)
                number = int(np.flatnonzero(self.signs() != before)[0]) + 1
                return instant, at, f"a change of sign of event indicator {number}"
            if self._completes and self._asks_for_events():
                return instant, at, "asked for by the FMU after an integration step"
        return stop, solution.y[:, -1], ""

    def _found(self, low: float, high: float, before: Array, states: Callable[[float], Array], u: Array) -> float:
        """The first instant [s] at which an indicator has changed its sign, by bisection: just behind the change."""
        while high - low > self._width(high):
            middle = 0.5 * (low + high)
            self._model.move(middle, states(middle), u)
            if (self.signs() != before).any():
                high = middle
            else:
                low = middle
        return high

    def _handled(self, t: float, x: Array, u: Array, event: str) -> Array:
        """States after the event that lies here, shape (n,)."""
        model, instance = self._model, self._instance
        model.move(t, x, u)

        def handle() -> Array:
            instance.guard("enterEventMode", instance.slave.enterEventMode)
            instance.settle()
            instance.guard("enterContinuousTimeMode", instance.slave.enterContinuousTimeMode)
            found: Array = instance.states()
            return found

        found: Array = model.called(handle)
        if instance.terminated:
            raise FmuModelError(f"{model.path}: at t = {t:.9g} s, at {event}, it asks for the end of the simulation.")
        return found

    def _asks_for_events(self) -> bool:
        enter, terminate = self._model.called(
            lambda: self._instance.guard("completedIntegratorStep", self._instance.slave.completedIntegratorStep)
        )
        self._instance.terminated |= bool(terminate)
        return bool(enter or terminate)

    @staticmethod
    def _width(t: float) -> float:
        return INSTANT * max(1.0, abs(t))


def integrated(
    path: str, rates: Callable[[float, Array], Array], begin: float, end: float, start: Array, *, dense: bool = False
) -> Any:
    """A solution by LSODA, for stiff equations too.

    Args:
        path: of the FMU, for messages. rates: of an instant [s] and states. begin, end: of the step [s].
        start: states, shape (n,). dense: whether states between the solver's steps are asked for.

    Returns:
        What SciPy's ``solve_ivp`` returns.

    Raises:
        FmuModelError: it does not succeed.
    """
    if not len(start):
        return NothingFlows(np.array([begin, end]), np.zeros((0, 2)))
    solution = scipy.integrate.solve_ivp(
        rates, (begin, end), start, method="LSODA", rtol=TOLERANCE, atol=TOLERANCE, dense_output=dense
    )
    if not solution.success:
        raise FmuModelError(f"{path}: its derivatives cannot be integrated from {begin:g} s: {solution.message}")
    return solution


class NothingFlows:
    """The solution of a model without continuous states.

    Args:
        t: begin and end [s]. y: nothing, shape (0, 2).
    """

    def __init__(self, t: Array, y: Array) -> None:
        self.t, self.y = t, y

    def sol(self, _t: float) -> Array:
        """Nothing, shape (0,)."""
        return np.zeros(0)
