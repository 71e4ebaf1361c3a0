"""The instance behind a block: a runtime with its events, its variables by value reference, and the mode of its life.

Both FMI faces (`fmi2`, `fmi3`) drive this one; it knows value references and modes, and nothing of fmpy's classes. What it
refuses it refuses with a reason; the face adds the name, the call and the time.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import inf, isfinite

import numpy as np

from fmu_observer.block.events import TIME_TOLERANCE, Events
from fmu_observer.block.policy import LatePolicy
from fmu_observer.block.state import BlockState, Shape, check_owner
from fmu_observer.block.variables import BlockError, Mode, Variables
from plant_models.hybrid import HybridSystem, Runtime, scalar_names

STEP_TOLERANCE = 1e-6
"""So much of a step may the master's time be off in addition, for masters that add their steps up [1]."""

DEFAULT_REPLAY_HORIZON = 10.0


class Instance:
    """One running copy of a hybrid system behind an FMI face.

    Args:
        system: the hybrid system.
        token: instantiation token of its description; saved states carry it.
        counts_events: whether events are announced by counts (FMI 2) or by clocks (FMI 3).
        preset: preset to start from.
        late_policy: what to do with events stamped in the past.
        replay_horizon: how far back `replay` can go [s].

    Raises:
        BlockError: the policy is unknown, or the horizon is not a time.
        ValueError: the preset is unknown.
    """

    def __init__(
        self, system: HybridSystem, token: str, counts_events: bool, preset: str | None = None,
        late_policy: LatePolicy = "replay", replay_horizon: float = DEFAULT_REPLAY_HORIZON,
    ) -> None:  # fmt: skip
        self.system, self.preset = system, preset
        self.runtime = Runtime(system)
        self.events = Events(system, self.runtime, late_policy, replay_horizon)
        self.variables = Variables(system, self.runtime, self.events.stamps, counts_events)
        self.shape = Shape(token, len(self.runtime.memory), len(self.runtime.ticks), self.events.payloads)
        self.reset()

    def reset(self) -> None:
        """Back to the start values of the preset."""
        self.runtime.reset()
        self.runtime.x[:] = self.system.start_state(self.preset)
        self.runtime.p[:] = self.system.start_parameters(self.preset)
        self.events.reset()
        self.mode: Mode = "instantiated"
        self._stale_outputs = True

    # -- variables --------------------------------------------------------------------------------------------------

    def get(self, references: Sequence[int]) -> list[float]:
        """Values of Float64 / Real variables by value reference.

        Raises:
            BlockError: a value reference is unknown or of another type, or the block has been freed.
        """
        self.require_alive()
        self._refresh_outputs()
        places = map(self.variables.readable, references)
        return [self.runtime.t if p.role == "time" else float(p.values[p.index]) for p in places]

    def set(self, references: Sequence[int], values: Sequence[float]) -> None:
        """Set Float64 / Real variables by value reference; nothing is set unless everything may be.

        Raises:
            BlockError: a value reference is unknown, or the variable cannot be set in this mode.
        """
        if len(references) != len(values):
            raise BlockError(f"{len(references)} value references but {len(values)} values; all variables are scalars.")
        places = [self.variables.settable(reference, self.mode) for reference in references]
        for place, value in zip(places, [float(value) for value in values], strict=True):
            place.values[place.index] = value
        self._stale_outputs = True

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
        u = self.runtime.u
        index = np.array([self.variables.place(reference).index for reference in references], dtype=np.intp)

        def write() -> None:
            u[index] = values
            self._stale_outputs = True

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
        self._stale_outputs = True

    def start(self) -> None:
        """Leave initialisation: time begins to run.

        Raises:
            BlockError: time cannot run with a parameter.
        """
        self._stale_outputs = True
        try:
            self.runtime.start(self.runtime.t0)
        except ValueError as error:
            raise BlockError(str(error)) from error
        except Exception as error:
            raise _model_failure(error) from error

    def step(self, t: float, h: float) -> None:
        """Advance from `t` by `h` [s], through the events announced and the queued ones whose stamps lie inside.

        Raises:
            BlockError: the block is not in step mode, `t` is not the current time, `h` is not positive, or the model fails.
        """
        if self.mode != "step":
            self.require("step")
        if not 0.0 < h < inf:
            raise BlockError(f"communicationStepSize = {h!r} s is not a positive number.")
        if not abs(t - self.runtime.t) <= TIME_TOLERANCE + STEP_TOLERANCE * h:
            raise BlockError(f"currentCommunicationPoint = {t!r} s, but the block stands at {self.runtime.t!r} s.")
        self._stale_outputs = True
        try:
            if self.events.counts != self.events.seen:
                self.events.poll_counts()
            self.events.advance(t + h)
        except Exception as error:
            raise _model_failure(error) from error
        self._check_finite()

    def tick(self) -> bool:
        """FMI 3: the events of the active clocks happen, in declared order; whether there were any.

        Raises:
            BlockError: the model fails.
        """
        ticked = sorted(self.events.active)
        self.events.active.clear()
        self._stale_outputs = True
        try:
            for number in ticked:
                self.events.tell(number)
        except Exception as error:
            raise _model_failure(error) from error
        return bool(ticked)

    # -- state ------------------------------------------------------------------------------------------------------

    def save(self) -> BlockState:
        """Everything that decides the future, as a value."""
        events = self.events
        return BlockState(
            token=self.shape.token,
            mode=self.mode,
            active=tuple(sorted(events.active)),
            runtime=self.runtime.snapshot(),
            records=() if events.journal is None else events.journal.records,
            queue=tuple(events.queue),
            stamps=tuple(events.stamps),
            counts=tuple(events.counts),
            seen=tuple(events.seen),
            counters=replace(events.counters),
        )

    def load(self, state: BlockState) -> None:
        """Return to a saved state, exactly; the policy for late events stays that of this block.

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
        events.restore_past(state.records)
        self._stale_outputs = True

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

    def _refresh_outputs(self) -> None:
        if self._stale_outputs:
            try:
                self.runtime.update_outputs()
            except Exception as error:
                raise _model_failure(error) from error
            self._stale_outputs = False

    def _check_finite(self) -> None:
        x = self.runtime.x
        if not isfinite(sum(x.tolist())) and not np.isfinite(x).all():  # the first is quick, the second right for huge states too
            broken = scalar_names(self.system.states)[int(np.flatnonzero(~np.isfinite(x))[0])]
            raise BlockError(f"state {broken} is not a finite number; check inputs, payloads, parameters and internal_step.")


def _model_failure(error: Exception) -> BlockError:
    """What the functions of a system throw is a failed call, with the original as its cause."""
    return BlockError(f"the model failed: {type(error).__name__}: {error}")
