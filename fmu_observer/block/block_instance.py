"""The instance behind a block: a runtime with its events, its variables by value reference, and the mode of its life.

Both FMI interfaces (`fmi2`, `fmi3`) drive this one; it knows value references and modes, and nothing of fmpy's classes.
What it refuses it refuses with a reason; the interface adds the name, the call and the time.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf, isfinite
from typing import NoReturn

import numpy as np

from fmu_observer.block.block_events import NO_MARK, TIME_TOLERANCE, Events
from fmu_observer.block.block_state import BlockState, Shape, check_owner
from fmu_observer.block.block_variables import (
    ALIVE,
    BEFORE_TIME,
    COMPUTED,
    OUTPUTS,
    BlockError,
    BlockVariables,
    Mode,
    Place,
    Role,
    StepDiscarded,
)
from fmu_observer.block.policy import Counters, communicate
from fmu_observer.block.timing import MOST_INTERNAL_STEPS, Timing
from fmu_observer.event_protocol import LATE_POLICIES, OUTCOME_VARIABLES, EventProtocol
from plant_models.hybrid import HybridSystem, Runtime, Snapshot, scalar_names
from plant_models.hybrid.switching import ChatteringError

STEP_TOLERANCE = 1e-6
"""So much of a step may the master's time be off in addition, for masters that add their steps up [1]."""

POLICY_NUMBERS = ", ".join(f"{i} ({name})" for i, name in enumerate(LATE_POLICIES, start=1))


class BlockInstance:
    """One running copy of a hybrid system behind an FMI interface.

    Args:
        system: the hybrid system.
        token: instantiation token of its description; saved states carry it.
        counts_events: whether events are announced by counts or by clocks.
        protocol: start values of the parameters that decide about late events.
        preset: preset to start from.
        name: of the instance.

    Raises:
        ValueError: the preset is unknown.
    """

    def __init__(
        self,
        system: HybridSystem,
        token: str,
        counts_events: bool,
        protocol: EventProtocol,
        preset: str | None = None,
        name: str | None = None,
    ) -> None:
        self.system, self.preset = system, preset
        self.runtime = Runtime(system, name=name)
        self.events = Events(system, self.runtime, protocol)
        self.variables = BlockVariables(system, self.runtime, self.events, counts_events)
        self._timing = Timing(system)
        self.shape = Shape(token, len(self.runtime.memory), len(self.runtime.ticks), self.events.payloads)
        self.reset()

    def reset(self) -> None:
        """Back to the start values of the preset."""
        self.runtime.reset()
        self.runtime.x[:] = self.system.start_state(self.preset)
        self.runtime.p[:] = self.system.start_parameters(self.preset)
        self.events.reset()
        self.mode: Mode = "instantiated"
        self.discarded = False  # whether the last step was
        self._plain_step, self._plain_for = 0.0, b""  # and the parameters for which that is so
        self.variables.outdate()

    # -- variables --------------------------------------------------------------------------------------------------

    def get(self, references: Sequence[int]) -> list[float]:
        """Values of Float64 / Real variables by value reference.

        Args:
            references: value references.

        Raises:
            BlockError: a value reference is unknown or of another type, or the block has been freed.
        """
        if self.mode == "freed":
            self.require(*ALIVE)
        places = self.variables.all_readable(references)
        self._refresh(places)
        return [self.runtime.t if p.role == "time" else float(p.values[p.index]) for p in places]

    def set(self, references: Sequence[int], values: Sequence[float]) -> None:
        """Set Float64 / Real variables by value reference; nothing is set unless everything may be.

        Args:
            references: value references.

        Raises:
            BlockError: a value reference is unknown, or the variable cannot be set in this mode.
        """
        if len(references) != len(values):
            raise BlockError(f"{len(references)} value references but {len(values)} values; all variables are scalars.")
        places = self.variables.all_settable(references, self.mode)
        for place, value in zip(places, list(map(float, values)), strict=True):
            place.values[place.index] = value
        self.variables.outdate()

    def get_whole(self, references: Sequence[int], roles: Sequence[Role]) -> list[int]:
        """Values of whole numbers that have one of these roles.

        Args:
            references: value references.

        Raises:
            BlockError: a value reference is unknown or of another type, or a value is no whole number of 32 bits.
        """
        self.require(*ALIVE)
        places = [self.variables.whole(reference, roles) for reference in references]
        self._refresh(places)
        return [self._whole_value(place) for place in places]

    def set_whole(self, references: Sequence[int], values: Sequence[int], roles: Sequence[Role]) -> None:
        """Set whole numbers that have one of these roles; nothing is set unless everything may be.

        Args:
            references: value references.

        Raises:
            BlockError: a value reference is unknown or of another type, the variable cannot be set now, or not to this
            value.
        """
        if len(references) != len(values):
            raise BlockError(f"{len(references)} value references but {len(values)} values; all variables are scalars.")
        for reference, value in zip(references, values, strict=True):
            place = self.variables.check_settable(reference, self.variables.whole(reference, roles), self.mode)
            if place.role == "policy" and value not in range(1, len(LATE_POLICIES) + 1):
                raise BlockError(f"late_policy = {value} is unknown; use {POLICY_NUMBERS}.")
        for reference, value in zip(references, values, strict=True):
            place = self.variables.place(reference)
            if place.role == "count":
                self.events.counts[place.index] = int(value)
            else:
                place.values[place.index] = float(value)

    def output_reader(self, references: Sequence[int], values: np.ndarray) -> Callable[[], None]:
        """A call that reads these outputs into `values`, shape (len(references),)."""
        runtime, y, stale = self.runtime, self.runtime.y, self.variables.stale
        index = np.array([self.variables.place(reference).index for reference in references], dtype=np.intp)

        def read() -> None:
            if "output" in stale:
                try:
                    runtime.compute_outputs(runtime.t)
                except Exception as error:
                    raise _model_failure(error) from error
                stale.difference_update(OUTPUTS)
            y.take(index, out=values, mode="clip")

        return read

    def input_writer(self, references: Sequence[int], values: np.ndarray) -> Callable[[], None]:
        """A call that sets these inputs proper from `values`, shape (len(references),)."""
        u, outdate = self.runtime.u, self.variables.outdate
        index = np.array([self.variables.place(reference).index for reference in references], dtype=np.intp)

        def write() -> None:
            u[index] = values
            outdate()

        return write

    # -- time -------------------------------------------------------------------------------------------------------

    def set_up(self, start_time: float) -> None:
        """Before time runs: where it will start [s].

        Raises:
            BlockError: `start_time` is not a finite number.
        """
        if not isfinite(start_time):
            raise BlockError(f"the start time {start_time!r} s is not a finite number.")
        self.runtime.t = self.runtime.t0 = float(start_time)
        self.variables.outdate()

    def start(self) -> None:
        """Leave initialisation: time begins to run.

        Raises:
            BlockError: time cannot run with a parameter.
        """
        self.variables.outdate()
        horizon = self.events.protocol[1]
        if not (isfinite(horizon) and horizon >= 0.0):
            raise BlockError(
                f"time cannot run with parameter replay_horizon = {horizon!r}; expected zero or more seconds."
            )
        self.events.restore_past(())  # as the policy has it that was set
        self.events.seen = list(self.events.counts)  # what stands there already is no event
        try:
            self.runtime.start(self.runtime.t0)
        except ValueError as error:
            raise BlockError(str(error)) from error
        except Exception as error:
            raise _model_failure(error) from error
        self._find_plain_step()

    def step(self, t: float, h: float, early_return: bool = False) -> bool:
        """Advance from `t` by `h` [s], through the events announced and the queued ones whose stamps lie inside.

        Args:
            t: where the block stands [s]. h: communication step [s].
            early_return: whether the step may end at the first periodic instant inside it.

        Returns:
            Whether it did.

        Raises:
            BlockError: the block is not in step mode, `t` is not the current time, or `h` is not positive.
            StepDiscarded: the model fails, its state is not finite afterwards, or the step is so large that no end of
            it is to be
                seen; the block stands where it stood before.
        """
        runtime, events = self.runtime, self.events
        if not (self.mode == "step" and 0.0 < h < inf and abs(t - runtime.t) <= TIME_TOLERANCE + STEP_TOLERANCE * h):
            raise self._no_step(t, h)
        due = runtime.next_instant_before(t + h) if early_return else None
        end = t + h if due is None else due
        if h > self._plain_step:
            self._check_size(h, end)
        before, mark = (
            (runtime.memory.copy(), runtime.t, runtime.t0, tuple(runtime.ticks)),
            events.mark() if events.payloads else NO_MARK,
        )
        self.variables.outdate()
        try:
            if events.counts != events.seen:
                events.poll_counts()
            if events.queue:
                events.take_until(end)
            if events.journal is not None and end > runtime.t:
                events.journal.append(runtime, end)
            runtime.advance(end)
            if runtime.system.communication_events:
                communicate(runtime, events.journal)
            # the first is quick, the second right for huge states too
            if not isfinite(sum(runtime.x.tolist())) and not np.isfinite(runtime.x).all():
                raise self._not_finite()
        except Exception as error:
            runtime.restore(Snapshot(*before))
            events.undo(mark)
            self._discard(error)
        self.discarded = False
        return due is not None

    def tick(self) -> bool:
        """FMI 3: the events of the active clocks happen, in declared order; whether there were any.

        Raises:
            BlockError: the model fails.
        """
        self.variables.outdate()
        try:
            return self.events.tick()
        except Exception as error:
            raise _model_failure(error) from error

    # -- state ------------------------------------------------------------------------------------------------------

    def save(self) -> BlockState:
        """Everything that decides the future, as a value.

        Raises:
            BlockError: the block has been freed.
        """
        if self.mode == "freed":
            self.require(*ALIVE)
        events = self.events
        return BlockState(
            token=self.shape.token,
            mode=self.mode,
            active=tuple(sorted(events.active)),
            runtime=self.runtime.snapshot(),
            protocol=(round(events.protocol[0]), events.protocol[1]),
            records=() if events.journal is None else events.journal.records,
            queue=tuple(events.queue),
            stamps=tuple(events.stamps),
            counts=tuple(events.counts),
            seen=tuple(events.seen),
            counters=Counters(**vars(events.counters)),
        )

    def check(self, state: BlockState) -> BlockState:
        """The state, if time can run on from it.

        Raises:
            BlockError: it cannot.
        """
        horizon = state.protocol[1]
        started = state.mode not in BEFORE_TIME
        if started and not (isfinite(horizon) and horizon >= 0.0 and self._timing.can_run(state.runtime)):
            raise BlockError(
                "time cannot run on from this state: its parameters, its clock or its horizon are damaged."
            )
        return state

    def load(self, state: BlockState) -> None:
        """Return to a saved state, exactly.

        Raises:
            BlockError: it is not a state, or one of another model, or the block has been freed.
        """
        if self.mode == "freed":
            self.require(*ALIVE)
        if not isinstance(state, BlockState):
            raise BlockError(f"{type(state).__name__} is not a saved state of a block; deserialise bytes first.")
        if state.token != self.shape.token:
            check_owner(state.token, self.shape.token)
        self.mode = state.mode
        self.runtime.restore(state.runtime)
        events = self.events
        events.active, events.queue, events.stamps[:] = set(state.active), list(state.queue), state.stamps
        events.counts, events.seen = list(state.counts), list(state.seen)
        vars(events.counters).update(vars(state.counters))
        events.protocol[:] = state.protocol
        if events.payloads:
            events.restore_past(state.records)
        self.discarded = False
        if self.runtime.p.tobytes() != self._plain_for:
            self._find_plain_step()
        self.variables.outdate()

    # -- life -------------------------------------------------------------------------------------------------------

    def require(self, *modes: Mode) -> None:
        """Refuse a call in the wrong mode.

        Raises:
            BlockError: the block is in none of these modes.
        """
        if self.mode not in modes:
            if modes == ALIVE:
                raise BlockError("the block has been freed; begin anew with instantiate().")
            hint = "; begin anew with reset() or instantiate()" if "instantiated" in modes else ""
            raise BlockError(f"not allowed in mode '{self.mode}', expected {' or '.join(modes)}{hint}.")

    # -- internals --------------------------------------------------------------------------------------------------

    def _find_plain_step(self) -> None:
        self._plain_step, self._plain_for = self._timing.plain_step(self.runtime.p), self.runtime.p.tobytes()

    def _check_size(self, h: float, end: float) -> None:
        runtime = self.runtime
        if not self._timing.count_steps(end, runtime.t, runtime.t0, runtime.p, runtime.ticks) <= MOST_INTERNAL_STEPS:
            self.discarded = True
            step = float(runtime.p[self._timing.step_position])
            raise StepDiscarded(
                f"communicationStepSize = {h!r} s holds more than {MOST_INTERNAL_STEPS:.0f} internal steps or periods "
                f"(internal_step = {step!r} s); make it smaller."
            )

    def _no_step(self, t: float, h: float) -> BlockError:
        """Why no step from `t` by `h` [s] can be taken."""
        self.require("step")
        if not 0.0 < h < inf:
            return BlockError(f"communicationStepSize = {h!r} s is not a positive number.")
        return BlockError(f"currentCommunicationPoint = {t!r} s, but the block stands at {self.runtime.t!r} s.")

    def _discard(self, error: Exception) -> NoReturn:
        """A step failed and is undone."""
        self.discarded = True
        reason = error if isinstance(error, BlockError) else _model_failure(error)
        why = str(reason).rstrip(".")
        raise StepDiscarded(f"{why}. The step is undone.") from reason.__cause__ or (None if reason is error else error)

    def _refresh(self, places: Sequence[Place]) -> None:
        try:
            for place in places:
                if place.role in COMPUTED:
                    self.variables.refresh(place.role)
        except Exception as error:
            raise _model_failure(error) from error

    def _whole_value(self, place: Place) -> int:
        if place.role == "outcome":
            value: float = getattr(self.events.counters, OUTCOME_VARIABLES[place.name])
        else:
            value = self.events.counts[place.index] if place.role == "count" else float(place.values[place.index])
        if not -(2.0**31) <= value < 2.0**31:
            raise BlockError(f"{place.name} = {value!r} is not a whole number of 32 bits.")
        return round(value)

    def _not_finite(self) -> BlockError:
        broken = scalar_names(self.system.states)[int(np.flatnonzero(~np.isfinite(self.runtime.x))[0])]
        return BlockError(
            f"state {broken} is not a finite number; check inputs, payloads, parameters and internal_step."
        )


def _model_failure(error: Exception) -> BlockError:
    """What the functions of a system throw is a failed call, with the original as its cause."""
    if isinstance(error, ChatteringError):
        return BlockError(str(error))
    return BlockError(f"the model failed: {type(error).__name__}: {error}")
