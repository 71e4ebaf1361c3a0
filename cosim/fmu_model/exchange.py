"""A model exchange FMU as a model: its states are set, its derivatives integrated here, its events handled on the way.
Touches one instance.

A linearisation looks at the equations that hold at its point: what the FMU decided at the restart (a contact that
sticks, a zone that is degraded) stays so.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import scipy

from cosim.fmu_model.sealed import Array, FmuModelError, SealedModel, Way, declared_states

_TOLERANCE = 1e-10
"""Relative and absolute, of the integration: far below what a filter or a difference shows."""
_INSTANT = 1e-12
"""Width to which the instant of an event is found, relative to the time and at least so many seconds."""
MOST_EVENTS = 100
"""In one step of a filter; more is a state that chatters, or a ball that bounces faster and faster."""


class _ContinuousModel(SealedModel):
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


class _EventRun:
    """Steps of a model exchange FMU with the events on their way.

    Args:
        model: the FMU, instantiated.
    """

    def __init__(self, model: _ContinuousModel) -> None:
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

        solution = _integrated(model.path, rates, t, stop, x, dense=self._indicators)
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
        return _INSTANT * max(1.0, abs(t))


def _integrated(
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
        return _NothingFlows(np.array([begin, end]), np.zeros((0, 2)))
    solution = scipy.integrate.solve_ivp(
        rates, (begin, end), start, method="LSODA", rtol=_TOLERANCE, atol=_TOLERANCE, dense_output=dense
    )
    if not solution.success:
        raise FmuModelError(f"{path}: its derivatives cannot be integrated from {begin:g} s: {solution.message}")
    return solution


class _NothingFlows:
    """The solution of a model without continuous states.

    Args:
        t: begin and end [s]. y: nothing, shape (0, 2).
    """

    def __init__(self, t: Array, y: Array) -> None:
        self.t, self.y = t, y

    def sol(self, _t: float) -> Array:
        """Nothing, shape (0,)."""
        return np.zeros(0)


class ExchangeModel(_ContinuousModel):
    """A model exchange FMU; arguments as for `SealedModel`. Its states are those that it declares, in its own order."""

    way: Way = "exchange"

    @property
    def directional(self) -> bool:
        """Whether the FMU declares directional derivatives."""
        return bool(self.instance.capabilities.providesDirectionalDerivatives)

    @property
    def derivative_names(self) -> list[str]:
        """Names of the derivatives of the states, in the order of the states."""
        instance = self.instance
        return [e.name for d in instance.description.derivatives for e in instance.variables.expanded(d.variable.name)]

    def demand_moved(self, x: Array) -> None:
        """Refuse an FMU that does not take its states.

        Args:
            x: states where it stands, shape (n,).

        Raises:
            FmuModelError: states that were set are not there.
        """
        moved = x + 1e-3 * np.maximum(np.abs(x), 1.0)
        self.called(lambda: self.instance.set_states(moved))
        found = self.called(self.instance.states)
        self.called(lambda: self.instance.set_states(x))
        wrong = np.flatnonzero(np.abs(found - moved) > 1e-9 * np.maximum(np.abs(moved), 1.0))
        if len(wrong):
            i = int(wrong[0])
            raise FmuModelError(
                f"{self.path}: setContinuousStates does not move {self.states[i]}: set to {float(moved[i])!r}, it "
                f"reads {float(found[i])!r}. Use its co-simulation where it has one."
            )

    def advance(self, t: float, h: float) -> None:
        """Integrate from where the instance stands by LSODA, for stiff equations too, inputs held, events handled.

        Raises:
            FmuModelError: the FMU refuses, asks for the end, or has more events than can be.
        """
        self._run.advance(t, h, self.called(self.instance.states), self._inputs.copy())

    def transition_with_slope(self, t: float, h: float, x: Array, u: Array) -> tuple[Array, Array] | None:
        """States after a step, and their Jacobian by the states before it: the variational equation ``dF = A F`` with A
        from directional derivatives, integrated along.

        Args:
            t: begin of the step [s]. h: its length [s]. x: states, shape (n,). u: inputs, held, shape (m,).

        Returns:
            States at its end, shape (n,), and the Jacobian, shape (n, n); None where an event lies in the step, over
            which this equation does not hold.
        """
        n, rows = len(x), self.derivative_names
        self.restart(t, x, u)
        before = self._run.signs()

        def rates(instant: float, at: Array) -> Array:
            self.move(instant, at[:n], u)
            A = self.slopes(rows)
            return np.concatenate([self.derivatives(), (A @ at[n:].reshape(n, n)).ravel()])

        whole = _integrated(self.path, rates, t, t + h, np.concatenate([x, np.eye(n).ravel()]))
        end = np.asarray(whole.y[:, -1])
        self.move(t + h, end[:n], u)
        if self.instance.next_event <= t + h or (self._run.signs() != before).any():
            return None
        return end[:n], end[n:].reshape(n, n)

    def slopes(self, unknowns: Sequence[str]) -> Array:
        """Directional derivatives by each state where the instance stands, shape (len(unknowns), n).

        Args:
            unknowns: derivatives of states, or outputs.
        """
        ask = self.instance.directional_derivative
        columns = self.called(lambda: [ask(unknowns, [name], [1.0]) for name in self.states])
        return np.array(columns).T.reshape(len(unknowns), len(self.states))

    def _own_states(self, stated: Sequence[str] | None) -> Sequence[str]:
        own = declared_states(self.instance)
        if stated is not None and not stated:
            return ()  # it starts where the FMU itself does
        if stated is not None and set(stated) != set(own):
            raise FmuModelError(
                f"{self.path}: in model exchange all states are set at once: {', '.join(own)}; given are: "
                f"{', '.join(stated)}."
            )
        return super()._own_states(None)

    def _demand_settable(self) -> None:
        """States that have no start of their own are set after initialisation: every state can be moved."""
        self._set_afterwards = not all(self._has_start(name) for name in self.states)

    def _restart(self, t: float, x: Array, u: Array) -> None:
        super()._restart(t, x, u)
        if self._set_afterwards:
            instance = self.instance
            instance.set_states(x)  # which FMI allows in Continuous-Time Mode only
            instance.guard("enterEventMode", instance.slave.enterEventMode)
            instance.settle()
            instance.guard("enterContinuousTimeMode", instance.slave.enterContinuousTimeMode)

    def _enter(self, t: float) -> None:
        self.instance.initialize(t)

    @cached_property
    def _run(self) -> _EventRun:
        return _EventRun(self)
