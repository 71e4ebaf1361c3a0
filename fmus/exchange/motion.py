"""The motion of a model exchange FMU: integrated from event to event, each found by the solver and handled by the FMU.

State events lie where an event indicator changes its sign, time events where the FMU announced them, step events where
it asks for one after a step of the solver. The solver goes on with what it knows as long as nothing jumps; it begins
anew after an event, and after a state was saved or restored, so that what follows a restored state is identical.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from fmpy.model_description import ModelDescription

from fmus.exchange.cvode import Cvode, SolverError
from fmus.exchange.jacobian import directional_derivatives
from fmus.exchange.model_calls import EventIteration, ModelCalls
from fmus.exchange.native_steps import ROUNDING, CExchange, MotionEnd, SharedField, load_steps
from fmus.fmi.elements import elements_of
from fmus.fmi.standard import (
    ERROR,
    NEVER,
    TIME_TOLERANCE,
    Method,
    fmi_version,
)

MotionState = tuple[bool, bool, float]
"""Whether it stands in Event Mode, whether the FMU asked for the end, and the next event that it knows of [s]."""
Part = Callable[[float, float], None]
"""Called when the solver has taken an internal step, with its begin and its end [s]."""


class _StepEnd(NamedTuple):
    """Where a step ended.

    Attributes:
        time: reached [s]. event: an event lies there. terminate: the FMU asks for the end.
    """

    time: float
    event: bool
    terminate: bool


class Motion:
    """States of one instance in time. It stands in Event Mode (`in_event_mode`) or in Continuous-Time Mode.

    Args:
        model: its calls. tolerance: relative, of the solver. method: of the solver.
        state_name: name of a state by its number, for messages.
        at: where it stands, which C shares.
    """

    in_event_mode = SharedField("in_event_mode", "Whether it stands in Event Mode.")
    terminated = SharedField("terminated", "Whether the FMU asked for the end.")
    next_event = SharedField("next_event", "The next event that the FMU knows of [s].")
    events = SharedField("events", "How many happened on the way, those of inputs left out.")

    def __init__(
        self,
        model: ModelCalls,
        tolerance: float,
        method: Method,
        state_name: Callable[[int], str],
        at: CExchange | None = None,
    ) -> None:
        self._model, self.state_name, self.at = model, state_name, CExchange() if at is None else at
        nominals = np.ones(max(model.state_count, 1))
        self.solver = Cvode(
            len(nominals),
            model.indicator_count,
            model.rates,
            model.indicators,
            tolerance,
            nominals,
            method,
            model.native(self.at),
            None if model.slopes is None else model.jacobian,
        )
        self.jacobian, self.told = "differences" if model.slopes is None else "directional derivatives", False
        """Where the solver has its Jacobian from; whether that tells that directional derivatives are not used."""
        self._x = self.solver.address(self.solver.states)
        self.follower: Part | None = None
        self.begin()

    def begin(self) -> None:
        """Initialisation has just ended: it stands in Event Mode."""
        self.in_event_mode, self.terminated, self.next_event = True, False, NEVER
        self.at.nominals_known = False
        self.at.last_event, self.at.at_once, self.events = -NEVER, 0, 0
        self.at.rooted = self.at.met = False
        self.follow(None)
        self.begin_anew()

    def follow(self, part: Part | None) -> None:
        """Have somebody called for each internal step, who may `look` at instants within it.

        Args:
            part: that is called; None for nobody.
        """
        self.follower = part
        self.at.elsewhere = self.solver.native is None or part is not None

    def state(self) -> MotionState:
        """What belongs to a saved state beside the FMU's own. What follows begins anew, as once it is restored."""
        self.begin_anew()
        return self.in_event_mode, self.terminated, self.next_event

    def restore(self, state: MotionState) -> None:
        """Return, once the FMU did.

        Args:
            state: from `state`.
        """
        self.in_event_mode, self.terminated, self.next_event = state
        self.at.nominals_known = False
        self.begin_anew()

    @property
    def derivative_calls(self) -> int:
        """How often the FMU was asked for derivatives."""
        native = self.solver.native
        return self._model.rate_count + (0 if native is None else int(native.rates))

    # -- events -----------------------------------------------------------------------------------------------------

    def enter_event_mode(self) -> None:
        """From Continuous-Time Mode to Event Mode; nothing where it is there."""
        if not self.in_event_mode:
            self._model.enter_event_mode()
            self.in_event_mode = True

    def settle(self) -> None:
        """In Event Mode: iterate until the discrete states do not change any more, and go on in Continuous-Time Mode.

        Raises:
            SolverError: they do not settle.
        """
        for _ in range(self.at.most_iterations):
            if not self.note(self._model.update()) or self.terminated:
                self.leave_event_mode()
                return
        raise self._trouble(MotionEnd.UNSETTLED)

    def note(self, update: EventIteration) -> bool:
        """Keep what the FMU said at the end of an event iteration; True where it needs another one.

        Args:
            update: what it said.

        Raises:
            SolverError: it says that the next event is at no time.
        """
        if math.isnan(update.next_event):
            raise self._trouble(MotionEnd.NO_TIME)
        self.next_event, self.terminated = update.next_event, self.terminated or update.terminate
        self.at.nominals_known &= not update.nominals
        return update.again

    def leave_event_mode(self) -> None:
        """From Event Mode, settled, to Continuous-Time Mode; the solver begins anew."""
        if not self.terminated:
            self._model.enter_continuous_mode()
        self.in_event_mode = False
        self.begin_anew()

    def begin_anew(self) -> None:
        """States jumped, or the FMU was set to others: the solver forgets the past."""
        self.at.anew = True

    # -- time -------------------------------------------------------------------------------------------------------

    def step(self, t: float, until: float) -> _StepEnd:
        """To the end of a communication step, with all events on the way and at its end.

        Args:
            t, until: begin and end [s].

        Raises:
            FMICallException, SolverError: see `advance`.
        """
        return self._whole(self.advance(t, until))

    def advance(self, t: float, until: float, *, returns: bool = False) -> _StepEnd:
        """To the end of a communication step, events on the way handled; one at its end is left to the caller.

        Args:
            t, until: begin and end [s]. returns: whether every event ends the step, and is left to the caller.

        Raises:
            FMICallException: the FMU refuses. SolverError: the solver cannot go on, or events do not settle.
        """
        library = load_steps() if not self.at.elsewhere else None
        if library is not None:
            ended = library.exchange_advance(ctypes.addressof(self.at), t, until, returns)
            return self._after(MotionEnd(ended), until, returns=returns)
        self.at.reached = t
        if until < t:
            raise self._trouble(MotionEnd.BACK, until)
        for _ in range(self.at.most_events):
            if self.in_event_mode:
                self.settle()
                if self.terminated:
                    return _StepEnd(t, event=False, terminate=True)
            end = self._to_event(t, until)
            if end.terminate or not end.event or returns or until - end.time <= TIME_TOLERANCE:
                return end
            t = self.at.reached = end.time
            self.enter_event_mode()
        raise self._trouble(MotionEnd.EVENTS)

    def proceed(self, ended: int, until: float) -> None:
        """See to what C left of a step; its structure has the end.

        Args:
            ended: how, see `MotionEnd`. until: where it was to end [s]; not a number where it has not begun.

        Raises:
            FMICallException, SolverError: see `advance`.
        """
        whole = self.at.version < 3
        end = self._after(MotionEnd(ended), until, returns=not whole and self.at.returns)
        if whole:
            end = self._whole(end)
        self.at.reached, self.at.event, self.at.end = end

    def _whole(self, end: _StepEnd) -> _StepEnd:
        """A step with the events at its end."""
        if end.event:
            self.enter_event_mode()
            self.settle()
        return end._replace(terminate=end.terminate or self.terminated)

    def _after(self, ended: MotionEnd, until: float, *, returns: bool) -> _StepEnd:
        """Where C ended; raises what the same step in Python raises, and goes on where the Jacobian was given up."""
        at = self.at
        if ended == MotionEnd.GAVE_UP:
            try:
                self.solver.fail(int(at.flag))
            except SolverError as error:
                return self.advance(self._given_up(error, at.reached).time, until, returns=returns)
        self._model.after_native(at, refused=ended == MotionEnd.REFUSED)
        if ended > MotionEnd.TERMINATE:
            raise self._trouble(ended, until)
        return _StepEnd(at.reached, ended == MotionEnd.EVENT, ended == MotionEnd.TERMINATE)

    def _trouble(self, ended: MotionEnd, until: float = math.nan) -> SolverError:
        """Why a step did not end, in words."""
        last = self._event if ended in (MotionEnd.CHATTERS, MotionEnd.EVENTS) else ""
        return SolverError(ended.words(self.at, until, last))

    def _to_event(self, t: float, until: float) -> _StepEnd:
        """To the first event, which is not handled, or the end of the step.

        Args:
            t, until: begin and end [s].
        """
        for _ in range(self.at.most_steps):
            self.at.rooted, event, stop = False, False, min(until, self.next_event)
            if stop - t > ROUNDING * max(abs(t), abs(stop)) * 2.0:
                t, event, terminate = self._internal_step(t, stop)
                if terminate:
                    self.terminated = True
                    return _StepEnd(t, event, terminate)
            elif stop > t:
                t = stop
                self._model.set_time(t)
            self.at.met = event
            self.at.reached = t
            if event or self.next_event <= t + ROUNDING * max(abs(t), 1.0):
                self._count_event(t)
                return _StepEnd(t, event=True, terminate=False)
            if t >= until - ROUNDING * max(abs(until), 1.0):
                return _StepEnd(until, event=False, terminate=False)
        raise self._trouble(MotionEnd.TOO_MANY)

    def states(self) -> np.ndarray:
        """Continuous states where it stands, shape (n,)."""
        found = np.zeros(self._model.state_count)
        self._model.states((ctypes.c_double * len(found)).from_address(found.ctypes.data))
        return found

    def put(self, t: float, states: np.ndarray) -> None:
        """To an instant [s] and continuous states, shape (n,), in Continuous-Time Mode."""
        if self.in_event_mode:
            self.settle()
        self._model.move(t, (ctypes.c_double * len(states)).from_address(states.ctypes.data))
        self.begin_anew()

    def look(self, t: float) -> None:
        """Put the FMU at an instant within the last internal step [s], in states from the solver's polynomial."""
        self._model.move(t, self.solver.address(self.solver.between(t)))

    def _internal_step(self, t: float, stop: float) -> _StepEnd:
        """One step of the solver."""
        model, solver = self._model, self.solver
        if self.at.anew:
            model.states(self._x)
            if not self.at.nominals_known:
                solver.absolute[:] = solver.tolerance * model.nominals()
                self.at.nominals_known = True
            solver.restart(t)
            self.at.anew = False
        try:
            reached, root = solver.step(stop)
        except SolverError as error:
            return self._given_up(error, t)
        self.at.rooted = root
        model.move(reached, self._x)
        if self.follower is not None:
            self.follower(t, reached)
            model.move(reached, self._x)
        wanted, terminate = model.completed()
        return _StepEnd(reached, root or wanted, terminate)

    def _given_up(self, error: SolverError, t: float) -> _StepEnd:
        """Where it stands, to go on by differences where the FMU gave the Jacobian up to now; else raises."""
        explained, model = self._explained(error, t), self._model
        if not self.solver.has_jacobian:
            raise explained from error
        why = f"with directional derivatives {explained}"
        if model.slopes is not None and model.differing is not None:
            rate = model.slopes.rates[model.differing]
            why = f"the directional derivatives of {rate} are not what differences give behind t = {t:.12g} s"
        self.jacobian, self.told = f"differences, since {why}", True
        self.solver.drop_jacobian()
        model.move(t, self._x)
        self.begin_anew()
        return _StepEnd(t, event=False, terminate=False)

    def _explained(self, error: SolverError, t: float) -> SolverError:
        """The solver's words with time and state, or those of the FMU where it refused what the solver asked."""
        if self.solver.native is not None:
            self._model.after_native(self.solver.native, refused=False)
        refused, self._model.failed = self._model.failed, None
        known = error.worst is not None and self._model.state_count
        worst = f"; it is worst for {self.state_name(error.worst or 0)}" if known else ""
        why = f" ({str(refused).rstrip('.')})" if refused is not None else ""
        words = f"the solver (CVODE) gives up at t = {t:.12g} s: {error}{why}{worst}"
        return SolverError(words, status=ERROR if refused is None else refused.status)

    @property
    def _event(self) -> str:
        """The last event in words."""
        if self.at.rooted:
            return f"where event indicator {self.solver.changed_root() + 1} changes its sign"
        return "asked for after a step of the solver" if self.at.met else "announced by the FMU"

    def _count_event(self, t: float) -> None:
        self.events += 1
        close = abs(t - self.at.last_event) <= TIME_TOLERANCE
        self.at.at_once = self.at.at_once + 1 if close else 1
        self.at.last_event = t
        if self.at.at_once > self.at.most_at_once:
            raise self._trouble(MotionEnd.CHATTERS)


def motion_of(
    slave: Any,
    description: ModelDescription,
    functions: dict[str, Any],
    tolerance: float,
    method: Method = "bdf",
    at: CExchange | None = None,
) -> Motion:
    """What moves an instance of an FMU, which stands at the end of its initialisation.

    Args:
        slave: fmpy's model, instantiated. description: of the FMU.
        functions: of the library by name, as it exports them.
        tolerance: relative, of the solver. method: of the solver. at: as for `Motion`.
    """
    version, interface = fmi_version(description), description.modelExchange
    unneeded = getattr(interface, "completedIntegratorStepNotNeeded", False)
    complete = not unneeded if version < 3 else interface.needsCompletedIntegratorStep
    counts = int(description.numberOfContinuousStates or 0), int(description.numberOfEventIndicators or 0)
    if version == 3:
        counts = slave.getNumberOfContinuousStates(), slave.getNumberOfEventIndicators()
    slopes = directional_derivatives(description, counts[0])
    model = ModelCalls(slave, version, counts, functions, complete_steps=complete, slopes=slopes)
    states = [unknown.variable.derivative for unknown in description.derivatives]
    names = [element.name for state in states if state is not None for element in elements_of(state)]

    def name(number: int) -> str:
        return f"state '{names[number]}'" if number < len(names) else f"state {number + 1}"

    return Motion(model, tolerance, method, name, at)
