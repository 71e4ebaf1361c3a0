"""A model exchange FMU as a model: its states are set, its derivatives integrated here, its events handled on the way.
Touches one instance.

A linearisation looks at the equations that hold at its point: what the FMU decided at the restart (a contact that
sticks, a zone that is degraded) stays so.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from cosim.fmu_model.exchange_events import ContinuousModel, EventRun, integrated
from cosim.fmu_model.sealed import Array, FmuModelError, Way, declared_states


class ExchangeModel(ContinuousModel):
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

        Args:
            t: instant [s]. h: how far [s].

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

        whole = integrated(self.path, rates, t, t + h, np.concatenate([x, np.eye(n).ravel()]))
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

    def _own_states(self, given: Sequence[str] | None) -> Sequence[str]:
        own = declared_states(self.instance)
        if given is not None and not given:
            return ()  # it starts where the FMU itself does
        if given is not None and set(given) != set(own):
            raise FmuModelError(
                f"{self.path}: in model exchange all states are set at once: {', '.join(own)}; given are: "
                f"{', '.join(given)}."
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
    def _run(self) -> EventRun:
        return EventRun(self)
