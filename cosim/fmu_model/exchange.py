"""A model exchange FMU as a model: its states are set, and the solver of `fmus.exchange` moves them from event to
event. Touches one instance.

A linearisation looks at the equations that hold at its point: what the FMU decided at the restart (a contact that
sticks, a zone that is degraded) stays so.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import scipy

from cosim.fmu_model.sealed import Array, FmuModelError, SealedModel, Way, declared_states
from fmus.exchange.cvode import Cvode, SolverError


class ExchangeModel(SealedModel):
    """A model exchange FMU; arguments as for `SealedModel`. Its states are those that it declares, in its own order."""

    way: Way = "exchange"

    @cached_property
    def _slope_calls(self) -> dict[tuple[str, ...], list[Callable[[], Array]]]:
        """Calls for directional derivatives along each state, by whose derivatives."""
        return {}

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

    def set_inputs(self, u: Array) -> None:
        """Write the inputs where the instance stands: they jump, which is an event.

        Args:
            u: inputs, shape (m,).
        """
        if len(self.inputs):
            self.called(self.instance.enter_event_mode)
            super().set_inputs(u)

    def transition_with_slope(self, t: float, h: float, x: Array, u: Array) -> tuple[Array, Array] | None:
        """States after a step, and their Jacobian by the states before it: the variational equation ``dF = A F`` with A
        from directional derivatives, integrated along.

        Args:
            t: begin of the step [s]. h: its length [s]. x: states, shape (n,). u: inputs, held, shape (m,).

        Returns:
            States at its end, shape (n,), and the Jacobian, shape (n, n); None where an event lies in the step, over
            which this equation does not hold.
        """
        n, end = len(x), t + h
        self.restart(t, x, u)
        before, solver = self._signs(), self._variational_solver(n, u)
        whole = solver.states
        whole[:] = np.concatenate([x, np.eye(n).ravel()])
        try:
            solver.run(t, end)
        except SolverError as error:
            raise FmuModelError(f"{self.path}: its derivatives cannot be integrated from {t:g} s: {error}.") from error
        self.move(end, whole[:n], u)
        if self.instance.next_event <= end or (self._signs() != before).any():
            return None
        return whole[:n].copy(), whole[n:].reshape(n, n).copy()

    def _variational_solver(self, n: int, u: Array) -> Cvode:
        """Of states and their Jacobian by those at the start, row by row, under held inputs, shape (m,)."""
        rows, size = self.derivative_names, n + n * n

        def rates(instant: float, at: Any, written: Any) -> int:
            here, found = np.ctypeslib.as_array(at), np.ctypeslib.as_array(written)
            self.move(instant, here[:n], u)
            A = self.slopes(rows)
            found[:n], found[n:] = self.derivatives(), (A @ here[n:].reshape(n, n)).ravel()
            return 0

        def jacobian(instant: float, at: Any, _rates: Any, columns: int) -> int:
            """Without the curvature of A, which a solver can do without."""
            self.move(instant, np.ctypeslib.as_array(at)[:n], u)
            A = self.slopes(rows)
            found = scipy.linalg.block_diag(A, np.kron(A, np.eye(n))).T
            ctypes.memmove(columns, np.ascontiguousarray(found).ctypes.data, found.nbytes)
            return 0

        return Cvode(size, 0, rates, rates, self.instance.motion.solver.tolerance, np.ones(size), jacobian=jacobian)

    def _signs(self) -> Array:
        """Which event indicators are positive where the instance stands, shape (number of them,)."""
        found = self.called(self.instance.indicators) if self.instance.indicator_count else np.zeros(0)
        return np.asarray(found > 0.0)

    def slopes(self, unknowns: Sequence[str]) -> Array:
        """Directional derivatives by each state where the instance stands, shape (len(unknowns), n).

        Args:
            unknowns: derivatives of states, or outputs.
        """
        instance, wanted = self.instance, tuple(unknowns)
        if wanted not in self._slope_calls:
            self._slope_calls[wanted] = [instance.derivative_call(wanted, [name], [1.0]) for name in self.states]
        calls = self._slope_calls[wanted]
        columns = self.called(lambda: [instance.guard("getDirectionalDerivative", call) for call in calls])
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
            instance.enter_event_mode()
            instance.settle()

    def _enter(self, t: float) -> None:
        self.instance.initialize(t)
