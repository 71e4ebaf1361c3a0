"""The instance behind a block: a runtime with its events, its variables by value reference, and the mode of its life.

Both FMI interfaces (`fmi2`, `fmi3`) drive this one; it knows value references and modes, and nothing of fmpy's classes.
What it refuses it refuses with a reason; the interface adds the name, the call and the time.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import inf, isfinite

import numpy as np

from fmu_observer.block.block_events import TIME_TOLERANCE, Events
from fmu_observer.block.block_state import BlockState, Shape, check_owner
from fmu_observer.block.block_variables import (
    BEFORE_TIME,
    COMPUTED,
    BlockError,
    BlockVariables,
    Mode,
    Place,
    Role,
    StepDiscarded,
)
from fmu_observer.block.timing import MOST_INTERNAL_STEPS, Timing
from fmu_observer.event_protocol import LATE_POLICIES, OUTCOME_VARIABLES, EventProtocol
from plant_models.hybrid import HybridSystem, Runtime, Snapshot, scalar_names

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
        self._plain_step = 0.0
        self.variables.touch()

    # -- variables --------------------------------------------------------------------------------------------------

    def get(self, references: Sequence[int]) -> list[float]:
        """Values of Float64 / Real variables by value reference.

        Args:
            references: value references.

        Raises:
            BlockError: a value reference is unknown or of another type, or the block has been freed.
        """
        self.require_alive()
        places = [self.variables.readable(reference) for reference in references]
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
        places = [self.variables.settable(reference, self.mode) for reference in references]
        for place, value in zip(places, [float(value) for value in values], strict=True):
            place.values[place.index] = value
        self.variables.touch()

    def get_whole(self, references: Sequence[int], roles: Sequence[Role]) -> list[int]:
        """Values of whole numbers that have one of these roles.

        Args:
            references: value references.

        Raises:
            BlockError: a value reference is unknown or of another type, or a value is no whole number of 32 bits.
        """
        self.require_alive()
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
        y, refresh = self.runtime.y, self._refresh_outputs
        index = np.array([self.variables.place(reference).index for reference in references], dtype=np.intp)

        def read() -> None:
            refresh()
            y.take(index, out=values, mode="clip")

        return read

    def input_writer(self, references: Sequence[int], values: np.ndarray) -> Callable[[], None]:
        """A call that sets these inputs proper from `values`, shape (len(references),)."""
        u, touch = self.runtime.u, self.variables.touch
        index = np.array([self.variables.place(reference).index for reference in references], dtype=np.intp)

        def write() -> None:
            u[index] = values
            touch()

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
        self.variables.touch()

    def start(self) -> None:
        """Leave initialisation: time begins to run.

        Raises:
            BlockError: time cannot run with a parameter.
        """
        self.variables.touch()
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
        self._plain_step = self._timing.plain_step(self.runtime.p)

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
        if self.mode != "step":
            self.require("step")
        if not 0.0 < h < inf:
            raise BlockError(f"communicationStepSize = {h!r} s is not a positive number.")
        if not abs(t - self.runtime.t) <= TIME_TOLERANCE + STEP_TOLERANCE * h:
            raise BlockError(f"currentCommunicationPoint = {t!r} s, but the block stands at {self.runtime.t!r} s.")
        runtime = self.runtime
        due = runtime.next_instant_before(t + h) if early_return else None
        if h > self._plain_step:
            self._check_size(h, t + h if due is None else due)
        before, mark = (runtime.memory.copy(), runtime.t, runtime.t0, tuple(runtime.ticks)), self.events.mark()
        self.variables.touch()
        try:
            self._move(t + h if due is None else due)
        except Exception as error:
            runtime.restore(Snapshot(*before))
            self.events.undo(mark)
            self.discarded = True
            reason = error if isinstance(error, BlockError) else _model_failure(error)
            why = str(reason).rstrip(".")
            raise StepDiscarded(f"{why}. The step is undone.") from reason.__cause__ or (
                None if reason is error else error
            )
        self.discarded = False
        return due is not None

    def tick(self) -> bool:
        """FMI 3: the events of the active clocks happen, in declared order; whether there were any.

        Raises:
            BlockError: the model fails.
        """
        self.variables.touch()
        try:
            return self.events.tick()
        except Exception as error:
            raise _model_failure(error) from error

    # -- state ------------------------------------------------------------------------------------------------------

    def save(self) -> BlockState:
        """Everything that decides the future, as a value."""
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
            counters=replace(events.counters),
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
            BlockError: it is not a state, or one of another model.
        """
        if not isinstance(state, BlockState):
            raise BlockError(f"{type(state).__name__} is not a saved state of a block; deserialise bytes first.")
        check_owner(state.token, self.shape.token)
        self.mode = state.mode
        self.runtime.restore(state.runtime)
        events = self.events
        events.active, events.queue, events.stamps[:] = set(state.active), list(state.queue), state.stamps
        events.counts, events.seen, events.counters = list(state.counts), list(state.seen), replace(state.counters)
        events.protocol[:] = state.protocol
        events.restore_past(state.records)
        self.discarded = False
        self._plain_step = self._timing.plain_step(self.runtime.p)
        self.variables.touch()

    # -- life -------------------------------------------------------------------------------------------------------

    def require(self, *modes: Mode) -> None:
        """Refuse a call in the wrong mode.

        Raises:
            BlockError: the block is in none of these modes.
        """
        if self.mode not in modes:
            hint = "; begin anew with reset() or instantiate()" if "instantiated" in modes else ""
            raise BlockError(f"not allowed in mode '{self.mode}', expected {' or '.join(modes)}{hint}.")

    def require_alive(self) -> None:
        """Refuse a call after the end of life.

        Raises:
            BlockError: the block has been freed.
        """
        if self.mode == "freed":
            raise BlockError("the block has been freed; begin anew with instantiate().")

    # -- internals --------------------------------------------------------------------------------------------------

    def _check_size(self, h: float, end: float) -> None:
        runtime = self.runtime
        if not self._timing.count_steps(end, runtime.t, runtime.t0, runtime.p, runtime.ticks) <= MOST_INTERNAL_STEPS:
            self.discarded = True
            step = float(runtime.p[self._timing.step_position])
            raise StepDiscarded(
                f"communicationStepSize = {h!r} s holds more than {MOST_INTERNAL_STEPS:.0f} internal steps or periods "
                f"(internal_step = {step!r} s); make it smaller."
            )

    def _move(self, end: float) -> None:
        events = self.events
        if events.counts != events.seen:
            events.poll_counts()
        events.advance(end)
        events.end_step()
        self._check_finite()

    def _refresh(self, places: Sequence[Place]) -> None:
        try:
            for place in places:
                if place.role in COMPUTED:
                    self.variables.refresh(place.role)
        except Exception as error:
            raise _model_failure(error) from error

    def _refresh_outputs(self) -> None:
        try:
            self.variables.refresh("output")
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

    def _check_finite(self) -> None:
        x = self.runtime.x
        # the first is quick, the second right for huge states too
        if not isfinite(sum(x.tolist())) and not np.isfinite(x).all():
            broken = scalar_names(self.system.states)[int(np.flatnonzero(~np.isfinite(x))[0])]
            raise BlockError(
                f"state {broken} is not a finite number; check inputs, payloads, parameters and internal_step."
            )


def _model_failure(error: Exception) -> BlockError:
    """What the functions of a system throw is a failed call, with the original as its cause."""
    return BlockError(f"the model failed: {type(error).__name__}: {error}")
