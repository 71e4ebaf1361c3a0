"""Iterate: loops are stepped again and again until what they feed back agrees; everything else is Gauss-Seidel."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cosim.components.component import Component
from cosim.coupling.feedthrough import declared_feedthrough
from cosim.coupling.plan import Plan, Service
from cosim.coupling.planned import PlannedComponent
from cosim.errors import RunError
from cosim.master.algorithms.acceleration import make_acceleration, scaled_norm
from cosim.master.algorithms.algorithm import Algorithm, IterationSettings
from cosim.master.algorithms.history import History, IterationSearch, shown
from cosim.master.algorithms.links import LoopLink, interface, plan_links, span
from fmus.fmi.types import FLOATING_TYPES

_SIGNALS_SHOWN = 5


@dataclass(frozen=True)
class _Passage:
    """What passes through one component at once.

    Args:
        component: the component. inputs, outputs: names. sources, factors: column and factor of each input, shape (m,).
        columns: of the outputs, shape (q,). fresh: inputs whose source was stepped before in the sweep, shape (m,).
    """

    component: Component
    inputs: list[str]
    outputs: list[str]
    sources: np.ndarray
    factors: np.ndarray
    columns: np.ndarray
    fresh: np.ndarray

    def gains(self) -> Callable[[], np.ndarray]:
        """A call that gives the directional derivatives of the outputs along each input, shape (q, m)."""
        calls = [self.component.derivative_call(self.outputs, [name], [1.0]) for name in self.inputs]
        return lambda: np.array([call() for call in calls]).T


class Sensitivity:
    """The Jacobian of a sweep over a loop as far as it passes through the components at once.

    Args:
        plan: the plan. members: places of the loop's components. links: of the plan. interface: columns fed back, shape
            (n,).

    `usable` says whether every component through which something passes at once declares directional derivatives.
    """

    def __init__(self, plan: Plan, members: range, links: Sequence[LoopLink], interface: np.ndarray) -> None:
        self._interface, self._count = interface, len(plan.values)
        inner = [link for link in links if link.source in members and link.target in members and not link.held]
        passages = [_passage(plan, place, inner) for place in members]
        self._passages = [p for p in passages if p is not None]
        self.usable = all(p.component.capabilities.providesDirectionalDerivatives for p in self._passages)
        self._gains = [p.gains() for p in self._passages] if self.usable else []

    def __call__(self) -> np.ndarray | None:
        """Derivatives of what comes back, where the components stand, shape (n, n); None where they are not to be
        had.
        """
        if not self.usable:
            return None
        size = len(self._interface)
        imposed, fresh = np.zeros((self._count, size)), np.zeros((self._count, size))
        imposed[self._interface] = np.eye(size)
        try:
            for passage, gains in zip(self._passages, self._gains, strict=True):
                before = np.where(passage.fresh[:, None], fresh[passage.sources], imposed[passage.sources])
                fresh[passage.columns] = gains() @ (passage.factors[:, None] * before)
        except Exception:  # whatever the slave throws: declared, and not given
            self.usable = False
            return None
        found: np.ndarray = fresh[self._interface]
        return found if np.isfinite(found).all() else None


def _passage(plan: Plan, place: int, inner: Sequence[LoopLink]) -> _Passage | None:
    """None where nothing passes through a component at once that comes from the loop and goes back into it."""
    step = plan.steps[place]
    component, stated = step.component, {link.column for link in inner if link.source == place}
    table = declared_feedthrough(component)
    used = {name for names in table.values() for name in names}
    taken = [
        k
        for k in inner
        if k.target == place
        and _is_real(component, n := step.inputs.names[k.place])
        and _variable(component, n) in used
    ]
    names = {column: plan.signals[column].name.removeprefix(f"{component.name}.") for column in stated}
    columns = sorted(
        c for c, name in names.items() if _is_real(component, name) and table.get(_variable(component, name))
    )
    if not taken or not columns:
        return None
    return _Passage(
        component,
        [step.inputs.names[link.place] for link in taken],
        [names[column] for column in columns],
        np.array([link.column for link in taken], dtype=np.intp),
        np.array([0.0 if link.place in step.inputs.tables else step.inputs.factors[link.place] for link in taken]),
        np.array(columns, dtype=np.intp),
        np.array([link.source < place for link in taken], dtype=bool),
    )


def _variable(component: Component, name: str) -> str:
    """The variable of this name, or the array that holds the element of this name."""
    found: str = component.variables[name].name
    return found


def _is_real(component: Component, name: str) -> bool:
    return component.variables[name].type in FLOATING_TYPES


@dataclass(frozen=True)
class Start:
    """Everything at the start of a step, and where in the values the members' part lies.

    Args:
        states: of the members. values: of the members, shape (q,). non_numeric: of all components, shape (k,).
        services: those of the plan and their states, where members are moved for good; None for trials.
    """

    states: list[Any]
    values: np.ndarray
    non_numeric: np.ndarray
    services: Sequence[tuple[Service, Any]] | None = None


class _IteratedLoop:
    """Consecutive components of a plan, stepped again and again from the same state until what is fed back agrees.

    The last sweep is kept: the inputs of that sweep and the outputs it left agree within the tolerances. Where somebody
    took over how a member is moved (balises are delivered within the loop), trial sweeps take the plain steps, and the
    last guess is stepped once more, for good. What jumps then is iterated on with the jump.

    Args:
        plan: prepared, components initialised. members: places of the loop's components in it. links: of the plan.
        settings: method and tolerances.
    """

    def __init__(self, plan: Plan, members: range, links: Sequence[LoopLink], settings: IterationSettings) -> None:
        self.steps = [plan.steps[place] for place in members]
        self.settings = settings
        self.history = History()
        self._columns = interface([link for link in links if not link.held], members)
        self._plan, self._span = plan, span(self.steps)
        self._known = [_ends_known(links, place, members) for place in members]
        self._jumps = ~plan.continuous[self._columns]
        self._sensitivity = Sensitivity(plan, members, links, self._columns)
        size = len(self._columns)
        self._acceleration = make_acceleration(settings.method, size, settings.relaxation, self._sensitivity)

    @property
    def names(self) -> list[str]:
        """Of the members, in execution order."""
        return [step.component.name for step in self.steps]

    @property
    def signals(self) -> list[str]:
        """What is fed back."""
        return [self._plan.signals[column].name for column in self._columns]

    def advance(self, t: float, until: float) -> None:
        """Bring the members from `t` to `until` [s].

        Raises:
            RunError: a component failed, or the iteration does not converge; the residuals are stated.
        """
        states = [step.component.save() for step in self.steps]
        start = Start(states, self._plan.values[self._span].copy(), self._plan.non_numeric.copy())
        try:
            self._iterate(t, until, start)
        except BaseException:
            with suppress(RunError):  # what went wrong before says more
                self._release(start)
            raise
        self._release(start)

    def save(self) -> Any:
        """What a step changes here; the components are saved elsewhere."""
        return self._acceleration.save(), replace(self.history)

    def restore(self, state: Any) -> None:
        """Return to what was saved."""
        learnt, history = state
        self._acceleration.restore(learnt)
        self.history = replace(history)

    def summary(self) -> dict[str, Any]:
        """Plain data."""
        found = {"components": self.names, "iterated": self.signals, "method": self.settings.method}
        if self.settings.method == "newton":
            found["jacobian"] = (
                "directional derivatives and Broyden updates" if self._sensitivity.usable else "Broyden updates"
            )
        return found | self.history.summary()

    # -- iteration --------------------------------------------------------------------------------------------------

    def _iterate(self, t: float, until: float, start: Start) -> None:
        residuals: list[float] = []
        z = self._search(t, until, start, self._plan.values[self._columns], residuals)
        if any(step.taken_over for step in self.steps):
            services = [(service, service.save_within()) for service in self._plan.services]
            self._restore(start)
            self._search(t, until, replace(start, services=services), z, residuals)
        self.history.add(IterationSearch(until, tuple(residuals)))

    def _search(self, t: float, until: float, start: Start, z: np.ndarray, residuals: list[float]) -> np.ndarray:
        """Sweep until what comes back is the guess, shape (n,), which is returned; the residuals are added to those so
        far.
        """
        settings, before = self.settings, len(residuals)
        while True:
            g = self._try(t, until, start, z, residuals)
            residual = scaled_norm(z, g, settings.relative_tolerance, settings.absolute_tolerance)
            settled = residual <= 1.0 or any(step.component.terminated for step in self.steps)
            if not settled or before == 0 or len(residuals) > before:
                residuals.append(residual)
            if settled:
                return z
            sweeps = len(residuals) - before
            if sweeps >= settings.max_iterations or not np.isfinite(residual):
                raise self._failure(until, start, z, g, residuals)
            if sweeps == 1:
                self._acceleration.begin(np.maximum(np.maximum(np.abs(z), np.abs(g)), settings.absolute_tolerance))
            z = np.where(self._jumps, g, self._acceleration.next(z, g))  # there is nothing between two discrete values
            self._restore(start)

    def _try(self, t: float, until: float, start: Start, z: np.ndarray, residuals: Sequence[float]) -> np.ndarray:
        """Step all members once; returns what comes back for the guess `z`, shape (n,)."""
        try:
            self._sweep(t, until, start, z)
        except RunError as error:
            if not residuals:
                raise
            self._plan.values[self._span] = start.values
            place = (
                f"sweep {len(residuals) + 1} of the iteration of {', '.join(self.names)}; residuals so far: "
                f"{shown(residuals)}"
            )
            raise RunError(f"{error} (In {place}.)", error.component, error.time) from error
        back: np.ndarray = self._plan.values[self._columns]
        return back

    def _sweep(self, t: float, until: float, start: Start, z: np.ndarray) -> None:
        """One step of all members; for good, each is moved by whoever took it over, and finds its outputs as they were
        at `t`.
        """
        values, first = self._plan.values, self._span.start
        values[self._span] = start.values
        values[self._columns] = z
        self._plan.non_numeric[:] = start.non_numeric
        for step, known in zip(self.steps, self._known, strict=True):
            step.prepare(t, until, ends_known=known)
            if start.services is not None:
                step.outputs[:] = start.values[step.columns.start - first : step.columns.stop - first]
                step.move(t, until)
            else:
                step.drive(t, until)

    def _restore(self, start: Start) -> None:
        for step, state in zip(self.steps, start.states, strict=True):
            step.component.restore(state)
        for service, state in start.services or ():
            service.restore_within(state)

    def _release(self, start: Start) -> None:
        for step, state in zip(self.steps, start.states, strict=True):
            step.component.release(state)

    def _failure(
        self, until: float, start: Start, z: np.ndarray, g: np.ndarray, residuals: Sequence[float]
    ) -> RunError:
        method, signals = self.settings.method, self.signals
        if len(residuals) > 1:
            self._plan.values[self._span] = start.values  # a guess gone astray is no result, and hides no cause
        with np.errstate(all="ignore"):
            errors = np.abs(g - z) / np.maximum(np.maximum(np.abs(z), np.abs(g)), self.settings.absolute_tolerance)
        worst = np.argsort(-np.where(np.isnan(errors), np.inf, errors), kind="stable")[:_SIGNALS_SHOWN]
        moving = ", ".join(f"{signals[i]} from {z[i]:.6g} to {g[i]:.6g}" for i in worst)
        other = "" if method == "newton" else "master.iteration.method = 'newton', "
        return RunError(
            f"Loop of {', '.join(self.names)} at t = {until:g} s: {len(residuals)} sweeps by '{method}' do not "
            f"converge. Scaled "
            f"residuals (1 is converged): {shown(residuals)}. Moving most in the last sweep: {moving}. Try {other}a "
            f"smaller "
            "communication step, a smaller master.iteration.relaxation, larger tolerances or more max_iterations; if "
            "the "
            "equations of the loop have no solution, nothing helps.",
            self.steps[0].component.name,
            until,
        )


def _ends_known(links: Sequence[LoopLink], place: int, members: range) -> np.ndarray:
    """Of each input of a member, whether its value is that of the end of the step: not held, of a member or stepped
    before.
    """
    return np.array(
        [link.source < members.stop and not link.held for link in links if link.target == place], dtype=bool
    )


class Iterate(Algorithm):
    """Implicit coupling of the loops, with the values at the end of the step.

    Args:
        plan: prepared, components initialised.
        loops: names of the components of each loop, consecutive in the plan.
        settings: method and tolerances.

    Source: R. Kuebler, W. Schiehlen, Two methods of simulator coupling, Mathematical and Computer Modelling of
    Dynamical Systems 6 (2000) 93-113; M. Busch, Zur effizienten Kopplung von Simulationsprogrammen, Kassel 2012,
    chapter 2.
    """

    name = "iterate"

    def __init__(self, plan: Plan, loops: Sequence[Sequence[str]], settings: IterationSettings | None = None) -> None:
        super().__init__(plan, loops)
        links = plan_links(plan)
        places = {step.component.name: place for place, step in enumerate(plan.steps)}
        self.loops: list[_IteratedLoop] = []
        self._parts: list[PlannedComponent | _IteratedLoop] = []
        first_of = {min(places[name] for name in names): names for names in loops}
        place = 0
        while place < len(plan.steps):
            if place not in first_of:
                self._parts.append(plan.steps[place])
                place += 1
                continue
            members = range(place, place + len(first_of[place]))
            assert {plan.steps[i].component.name for i in members} == set(first_of[place]), (
                "a loop is consecutive in its plan"
            )
            self.loops.append(_IteratedLoop(plan, members, links, settings or IterationSettings()))
            self._parts.append(self.loops[-1])
            place = members.stop

    def advance(self, t: float, until: float) -> None:  # noqa: D102 - see Algorithm
        for part in self._parts:
            if isinstance(part, _IteratedLoop):
                part.advance(t, until)
            else:
                part.step(t, until)

    def save(self) -> Any:  # noqa: D102 - see Algorithm
        return [loop.save() for loop in self.loops]

    def restore(self, state: Any) -> None:  # noqa: D102 - see Algorithm
        for loop, saved in zip(self.loops, state, strict=True):
            loop.restore(saved)

    def summary(self) -> Mapping[str, Any]:  # noqa: D102 - see Algorithm
        return {**super().summary(), "loops": [loop.summary() for loop in self.loops]}
