"""A model exchange FMU as a model: its states are set, its derivatives integrated here. Touches one instance.

Between two restarts no event happens: what the FMU decided at the restart (a contact that sticks, a zone that is
degraded) stays so. That is what a linearisation and one step of a filter need.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import scipy

from cosim.fmu_model.sealed import Array, FmuModelError, SealedModel, declared_states

TOLERANCE = 1e-10
"""Relative and absolute, of the integration: far below what a filter or a difference shows."""


class ExchangeModel(SealedModel):
    """A model exchange FMU; arguments as for `SealedModel`. Its states are those that it declares, in its own order."""

    way = "exchange"

    @property
    def directional(self) -> bool:
        """Whether the FMU declares directional derivatives."""
        return bool(self.instance.capabilities.providesDirectionalDerivatives)

    @property
    def derivative_names(self) -> list[str]:
        """Names of the derivatives of the states, in the order of the states."""
        instance = self.instance
        return [e.name for d in instance.description.derivatives for e in instance.variables.expanded(d.variable.name)]

    def derivatives(self) -> Array:
        """Derivatives of the states where the instance stands, shape (n,)."""
        found: Array = self.told(self.instance.derivatives)
        return found

    def move(self, t: float, x: Array, u: Array) -> None:
        """Set time, states and inputs in Continuous-Time Mode: no event is looked for.

        Args:
            t: instant [s]. x: states, shape (n,). u: inputs, shape (m,).
        """

        def move() -> None:
            self.instance.set_time(t)
            self.instance.set_states(x)
            if len(self.inputs):
                self._inputs[:] = u
                self._write_inputs()

        self.told(move)

    def demand_moved(self, x: Array) -> None:
        """Refuse an FMU that does not take its states.

        Args:
            x: states where it stands, shape (n,).

        Raises:
            FmuModelError: states that were set are not there.
        """
        moved = x + 1e-3 * np.maximum(np.abs(x), 1.0)
        self.told(lambda: self.instance.set_states(moved))
        found = self.told(self.instance.states)
        self.told(lambda: self.instance.set_states(x))
        wrong = np.flatnonzero(np.abs(found - moved) > 1e-9 * np.maximum(np.abs(moved), 1.0))
        if len(wrong):
            i = int(wrong[0])
            raise FmuModelError(
                f"{self.path}: setContinuousStates does not move {self.states[i]}: set to {float(moved[i])!r}, it "
                f"reads {float(found[i])!r}. Use its co-simulation where it has one."
            )

    def advance(self, t: float, h: float) -> None:
        """Integrate from where the instance stands by LSODA, for stiff equations too, inputs held.

        Args:
            t: instant [s]. h: how far [s].

        Raises:
            FmuModelError: the FMU refuses.
        """
        x, u = self.told(self.instance.states), self._inputs.copy()

        def rates(instant: float, at: Array) -> Array:
            self.move(instant, at, u)
            return self.derivatives()

        self.move(t + h, self._integrated(rates, t, h, x), u)

    def transition_with_slope(self, t: float, h: float, x: Array, u: Array) -> tuple[Array, Array]:
        """States after a step, and their Jacobian by the states before it: the variational equation ``dF = A F`` with A
        from directional derivatives, integrated along.

        Args:
            t: begin of the step [s]. h: its length [s]. x: states, shape (n,). u: inputs, held, shape (m,).

        Returns:
            States at its end, shape (n,), and the Jacobian, shape (n, n).
        """
        n, rows = len(x), self.derivative_names
        self.restart(t, x, u)

        def rates(instant: float, at: Array) -> Array:
            self.move(instant, at[:n], u)
            A = self.slopes(rows)
            return np.concatenate([self.derivatives(), (A @ at[n:].reshape(n, n)).ravel()])

        end = self._integrated(rates, t, h, np.concatenate([x, np.eye(n).ravel()]))
        self.move(t + h, end[:n], u)
        return end[:n], end[n:].reshape(n, n)

    def slopes(self, unknowns: Sequence[str]) -> Array:
        """Directional derivatives by each state where the instance stands, shape (len(unknowns), n).

        Args:
            unknowns: derivatives of states, or outputs.
        """
        ask = self.instance.directional_derivative
        columns = self.told(lambda: [ask(unknowns, [name], [1.0]) for name in self.states])
        return np.array(columns).T.reshape(len(unknowns), len(self.states))

    def _integrated(self, rates: Callable[[float, Array], Array], t: float, h: float, start: Array) -> Array:
        solution = scipy.integrate.solve_ivp(
            rates, (t, t + h), start, method="LSODA", rtol=TOLERANCE, atol=TOLERANCE, t_eval=[t + h]
        )
        if not solution.success:
            raise FmuModelError(f"{self.path}: its derivatives cannot be integrated from {t:g} s: {solution.message}")
        return np.asarray(solution.y[:, -1])

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
            instance.guard("enterEventMode", instance.slave.enterEventMode)
            instance.set_states(x)
            instance.settle()
            instance.guard("enterContinuousTimeMode", instance.slave.enterContinuousTimeMode)

    def _enter(self, t: float) -> None:
        self.instance.initialize(t)
