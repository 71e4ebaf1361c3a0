"""The instance behind a block: a runtime, its variables by value reference, and its queue of stamped events.

Both FMI faces (`fmi2`, `fmi3`) drive this one; it knows value references and modes, and nothing of fmpy's classes. What it
refuses it refuses with a reason; the face adds the name, the call and the time.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from math import inf, isfinite

import numpy as np

from fmu_observer.block.journal import Journal, Stamped
from fmu_observer.block.policy import LATE_POLICIES, Counters, LatePolicy, advance, jump, replay
from fmu_observer.block.state import BlockState, Shape, check_owner
from fmu_observer.block.variables import BlockError, Mode, Variables
from fmu_observer.description import STAMP_NOW, exposed_inputs
from plant_models.hybrid import HybridSystem, Runtime, scalar_names, width

TIME_TOLERANCE = 1e-9
"""Two communication times closer than this are the same [s]; below any sampling in use, above rounding at 1e5 s."""

STEP_TOLERANCE = 1e-6
"""So much of a step may the master's time be off in addition, for masters that add their steps up [1]."""

DEFAULT_REPLAY_HORIZON = 10.0

_log = logging.getLogger(__name__)


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
        if late_policy not in LATE_POLICIES:
            raise BlockError(f"late_policy {late_policy!r} is unknown; use one of {', '.join(LATE_POLICIES)}.")
        if not replay_horizon >= 0.0:
            raise BlockError(f"replay_horizon = {replay_horizon!r} s; expected zero or more seconds.")
        self.system, self.preset, self.late_policy, self.replay_horizon = system, preset, late_policy, replay_horizon
        self.runtime = Runtime(system)
        self._payloads = _payload_positions(system)
        self.shape = Shape(token, len(self.runtime.memory), len(self.runtime.ticks), self._payloads)
        self.stamps = [STAMP_NOW] * len(self._payloads)
        self.variables = Variables(system, self.runtime, self.stamps, counts_events)
        self._given = _given_positions(system, self.runtime)
        self._remembers = bool(self._payloads) and late_policy == "replay"
        self.reset()

    def reset(self) -> None:
        """Back to the start values of the preset."""
        self.runtime.reset()
        self.runtime.x[:] = self.system.start_state(self.preset)
        self.runtime.p[:] = self.system.start_parameters(self.preset)
        count = len(self._payloads)
        self.mode: Mode = "instantiated"
        self.active: set[int] = set()
        self.stamps[:] = [STAMP_NOW] * count
        self.counts = [0] * count
        self._seen = [0] * count
        self._queue: list[Stamped] = []
        self.counters = Counters()
        self._journal = Journal(self.replay_horizon) if self._remembers else None
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
            if self.counts != self._seen:
                self._poll_counts()
            if self._queue:
                self._take_until(t + h)
            advance(self.runtime, self._journal, t + h)
        except Exception as error:
            raise _model_failure(error) from error
        self._check_finite()

    def tick(self) -> bool:
        """FMI 3: the events of the active clocks happen, in declared order; whether there were any.

        The payload stands in the inputs, the stamp in `stamps` (unset: now). A stamp ahead waits for its step.

        Raises:
            BlockError: the model fails.
        """
        ticked = sorted(self.active)
        self.active.clear()
        for number in ticked:
            self._stale_outputs = True
            self._enqueue(number)
            try:
                self._take_until(self.runtime.t)
            except Exception as error:
                raise _model_failure(error) from error
        return bool(ticked)

    # -- state ------------------------------------------------------------------------------------------------------

    def save(self) -> BlockState:
        """Everything that decides the future, as a value."""
        return BlockState(
            token=self.shape.token,
            mode=self.mode,
            active=tuple(sorted(self.active)),
            runtime=self.runtime.snapshot(),
            records=() if self._journal is None else self._journal.records,
            queue=tuple(self._queue),
            stamps=tuple(self.stamps),
            counts=tuple(self.counts),
            seen=tuple(self._seen),
            counters=replace(self.counters),
        )

    def load(self, state: BlockState) -> None:
        """Return to a saved state, exactly.

        Raises:
            BlockError: it is not a state, or one of another model.
        """
        if not isinstance(state, BlockState):
            raise BlockError(f"{type(state).__name__} is not a saved state of a block; deserialise bytes first.")
        check_owner(state.token, self.shape.token)
        self.mode, self.active = state.mode, set(state.active)
        self.runtime.restore(state.runtime)
        self._journal = Journal(self.replay_horizon, state.records) if self._remembers else None
        self._queue, self.stamps[:] = list(state.queue), state.stamps
        self.counts, self._seen, self.counters = list(state.counts), list(state.seen), replace(state.counters)
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

    def _poll_counts(self) -> None:
        """FMI 2: a raised ``<event>_count`` announces one event; more than one step up means that events were lost."""
        for number, (count, seen) in enumerate(zip(self.counts, self._seen, strict=True)):
            if count == seen:
                continue
            self._seen[number] = count
            if count > seen:
                self.counters.lost += count - seen - 1
                self._enqueue(number)
            if count != seen + 1:
                what = "only the last payload is known" if count > seen else "no event is taken from that"
                name = self.system.triggered_events[number].name
                _log.warning("event %s at t = %s s: the count went from %d to %d; %s", name, self.runtime.t, seen, count, what)

    def _enqueue(self, number: int) -> None:
        name = self.system.triggered_events[number].name
        stamp = self.stamps[number] if self.stamps[number] > STAMP_NOW else self.runtime.t
        self.stamps[number] = STAMP_NOW
        positions = self._payloads[name]
        self._queue.append(Stamped(name, stamp, positions, tuple(float(self.runtime.u[i]) for i in positions)))
        self._queue.sort(key=lambda e: e.stamp)  # of equal stamps the one announced first stays first

    def _take_until(self, end: float) -> None:
        while self._queue and self._queue[0].stamp <= end + TIME_TOLERANCE:
            self._take(self._queue.pop(0))

    def _take(self, event: Stamped) -> None:
        runtime = self.runtime
        if event.stamp >= runtime.t - TIME_TOLERANCE:
            advance(runtime, self._journal, event.stamp)
            jump(runtime, self._journal, event)
            self.counters.accepted += 1
        elif self._journal is not None and replay(runtime, self._journal, event, self._given, TIME_TOLERANCE):
            self.counters.accepted += 1
            self.counters.replayed += 1
        elif self.late_policy == "late":
            jump(runtime, None, event)
            self.counters.accepted += 1
            self.counters.late += 1
        else:
            self.counters.rejected += 1


def _model_failure(error: Exception) -> BlockError:
    """What the functions of a system throw is a failed call, with the original as its cause."""
    return BlockError(f"the model failed: {type(error).__name__}: {error}")


def _payload_positions(system: HybridSystem) -> dict[str, tuple[int, ...]]:
    lengths = [width(event.payload) for event in system.triggered_events]
    starts = np.cumsum([width(system.inputs), *lengths]).tolist()
    assert starts[-1] == width(exposed_inputs(system))
    names = [event.name for event in system.triggered_events]
    return {name: tuple(range(a, b)) for name, (a, b) in zip(names, pairwise(starts), strict=True)}


def _given_positions(system: HybridSystem, runtime: Runtime) -> np.ndarray:
    """Where in the runtime's memory stands what is set from outside at any time: inputs proper, and parameters."""
    states, inputs = len(runtime.x), len(runtime.u)
    return np.array([*range(states, states + width(system.inputs)), *range(states + inputs, len(runtime.memory))], dtype=np.intp)
