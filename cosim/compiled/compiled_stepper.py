"""Chunks: communication steps that the compiled stepper does in one call, and the way back to Python where one is
odd.

A chunk ends at a row of events that Python knows beforehand (a telegram, an instant, a time event), and at whatever
the stepper
meets: then the Python stepper finishes the step from where it stands.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from operator import attrgetter
from time import perf_counter
from typing import Any

from cosim.balises.recorded import RecordedLocaliser
from cosim.balises.rollback import RollbackLocaliser
from cosim.compiled.coordination import Coordination, Parts
from cosim.compiled.crossings import Crossings
from cosim.compiled.library import load_stepper
from cosim.compiled.notifying import CompiledDelivery, can_be_notified
from cosim.compiled.program import NotCompilable, Program, Stop
from cosim.compiled.recorded_returns import RecordedReturn, Repetition
from cosim.compiled.turns import Turns, stands
from cosim.components.component import Component
from cosim.coupling.chain import COMPILED_STAGE_TEXT, Mover, Position, Stage
from cosim.coupling.plan import Plan
from cosim.coupling.planned import PlannedComponent
from cosim.diagnostics.sampled_times import typical_seconds
from cosim.master.axis import TimeAxis
from cosim.master.control.control import StepControl
from cosim.master.events.coordinator import EventCoordinator
from cosim.master.stepper import Chunk
from cosim.master.system import NO_ROWS, Row, System
from cosim.results.recorder import Recorder
from fmus.fmi.standard import NEVER, TIME_TOLERANCE
from fmus.toolchain.compile import CompilationError, CompilerMissing

LONGEST = 4096
SECONDS = 0.03
"""A chunk is to last so long at most [s]: between two of them Ctrl-C is seen and progress reported."""

GROWTH = 8
"""A chunk is at most so many times as long as the one before it."""

ROWS_OF_EVENTS = 64
"""Room for those in a chunk that may hold some; where it is not enough, the chunk is shorter."""

WITHIN = frozenset({Stop.REFUSED, Stop.WRITE, Stop.STEP, Stop.READ, Stop.ARRIVE, Stop.CROSSED, Stop.TURN, Stop.EVENTS})
"""The chunk ended within a step, at one of the slaves."""

STEPPED = frozenset({Stop.STEP, Stop.READ, Stop.ARRIVE, Stop.CROSSED})
"""That one has been called to do the step."""


_STOPS = {int(stop): stop for stop in Stop}
_NEXT_EVENT, _TERMINATED = attrgetter("next_event"), attrgetter("terminated")


class CompiledStepper:
    """Does ordinary communication steps in C.

    Args:
        control: the step control of the run, through which Python does the other steps.
        axis: communication points.

    `steps` counts what it did, `in_python` says of each component that Python moves in them why.

    Raises:
        NotCompilable: why it cannot do any.
    """

    def __init__(self, control: StepControl, axis: TimeAxis) -> None:
        self.control, self.axis = control, axis
        self.system: System = control.system
        self.plan: Plan = self.system.plan
        self.steps, self._seconds, self._share_of_steps = 0, 0.0, 0.0
        self._components = [step.component for step in self.plan.steps]
        self._moves = [{"get": 0, "set": 0} for _ in self.plan.steps]
        self._longest = 1
        self._library = _load()
        self._program = program = Program(self.plan, axis, self._library)
        program.head.seconds_at_most = SECONDS
        self.in_python = {self._components[place].name: why for place, why in program.in_python.items()}
        self._address = program.address
        self._turns = Turns(
            program.head, self.plan, axis, list(program.in_python), at_once=self.system.algorithm.name == "jacobi"
        )
        self._own = [place for place in range(len(self.plan.steps)) if place not in program.in_python]
        self._with_events, self._coordination = self._watch_events()
        self._plain = not any(bool(slave.special) for slave in program.slaves)
        self._repetition = Repetition([component.slave for component in self._components])
        self._crossings = self._watch_balises()
        for place in self._own:
            step = self.plan.steps[place]
            if step.interpolator is None:
                self._quicken(place, step)
            step.component.clock = partial(self._time_in_chunk, place, step.component)
        self._first: int | None = None
        self._stops_at_packets = False
        if self._parts is not None:
            self.system.shortcut = self._part

    def run(self, k: int, recorder: Recorder) -> Chunk:
        """Do steps from number `k` on.

        Raises:
            OutputError: the recorder takes no more rows.
        """
        alone = self._plain and self._coordination is None
        own_crossings = self._crossings is not None and self._crossings.allow(recorder.every == 1 and alone)
        self._stops_at_packets = recorder.every == 1 and self._coordination is None
        free = self._free_steps(k)
        if free < 1:
            return Chunk(0, partial(self._whole_step, k))
        wanted = min(free, self._longest)
        rows = recorder.block(wanted + ROWS_OF_EVENTS if own_crossings else wanted)
        head = self._program.head
        self._program.count_rows_at(recorder.count_address, recorder.block_start)
        self._first = k
        run = self._library.stepper_run
        done = int(run(self._address, k, k + wanted, rows.__array_interface__["data"][0], len(rows)))
        self._first = None
        recorder.commit(int(head.rows_done))
        stop = _STOPS[head.stop]
        self.steps += done + (stop is Stop.EVENTS)
        self._seconds += head.seconds
        if self._crossings is not None:
            self._crossings.collect()
        self._set_times(k + done)
        if done == wanted and self._stops_at_packets:
            self._pass_packets(self.axis[k + done], recorder)
        if done:
            fitting = int(self._longest * SECONDS / max(head.seconds, 1e-9))
            self._longest = max(1, min(fitting, GROWTH * self._longest, LONGEST))
        return self._ended(k, done, stop)

    def _ended(self, k: int, done: int, stop: Stop) -> Chunk:
        if stop in (Stop.DONE, Stop.TIME):
            return Chunk(done)
        if stop is Stop.NOT_FINITE:
            return Chunk(done, suspect=True)
        if stop is Stop.NEAR:
            return Chunk(done, partial(self._whole_step, k + done))
        if stop is Stop.HANDED:
            return Chunk(done, partial(self._step_again, k + done, self._program.journalled()))
        return Chunk(done, partial(self._rest_of_step, k + done))

    def _time_in_chunk(self, place: int, component: Component) -> float:
        """Where a component stands that logs something while C steps it: its calls so far show the step it is in."""
        if self._first is None:
            return component.time
        if self._program.head.journal.on:
            return float(self._program.slaves[place].now)
        return self.axis[self._first + max(self._program.slaves[place].calls - 1, 0)]

    # -- how far ----------------------------------------------------------------------------------------------------

    def _free_steps(self, k: int) -> int:
        """How many steps from number `k` on hold nothing that is known to be Python's; crossings the stepper leaves to
        it.
        """
        free, balises = self.axis.count - k, self.system.balises
        limit = min(map(_NEXT_EVENT, self._with_events), default=NEVER)
        if any(map(_TERMINATED, self._components)):
            return 0
        if self._coordination is not None and not self._coordination.begin(self.axis[k]):
            return 0
        if balises is not None:
            limit = min(limit, balises.idle_until)
        if self._crossings is not None and self._crossings.recorded:
            limit = min(limit, self._crossings.idle_until)
        network = self.system.network
        if network is None or network.idle_until >= limit:
            return free if limit == NEVER else min(free, self._steps_before(k, limit))
        before = self._steps_before(k, network.idle_until)
        meets = self.axis[k + before + 1] if network.idle_until > -math.inf and before < free else -math.inf
        on_grid = abs(meets - network.idle_until) <= TIME_TOLERANCE and meets + 2.0 * TIME_TOLERANCE < limit
        if on_grid and self._stops_at_packets:
            before += 1  # what is sent or arrives there is seen to between two chunks
        return min(free, before)

    def _pass_packets(self, t: float, recorder: Recorder) -> None:
        """All components stand at `t` [s], whose row is written: send and deliver what is due, and write it again."""
        network, values = self.system.network, self.plan.values
        if network is None or not network.is_due(t):
            return
        before = values.tobytes()
        network.handle(t)
        if values.tobytes() != before:
            recorder.add_event(t, values)

    def _steps_before(self, k: int, limit: float) -> int:
        """How many steps from number `k` on end before `limit` [s], and not nearly there."""
        if limit == -math.inf:
            return 0
        start, step = self.axis.start, self.axis.step
        last = math.floor((limit - start) / step) + 1
        while last > k and not start + last * step + 2.0 * TIME_TOLERANCE < limit:
            last -= 1
        return last - k

    # -- Python's part ----------------------------------------------------------------------------------------------

    def _whole_step(self, k: int) -> Sequence[Row]:
        return self.control.step(self.axis[k], self.axis[k + 1])

    def _step_again(self, k: int, said: Mapping[int, Mapping[str, Sequence[RecordedReturn]]]) -> Sequence[Row]:
        """The whole of step `k`, of which the stepper has done a part: the slaves repeat what they said."""
        with self._repetition.of(said):
            return self._whole_step(k)

    def _rest_of_step(self, k: int) -> Sequence[Row]:
        """What is left of step `k` once the stepper, which has begun it, has left it at one of the slaves."""
        t, until, first = self.axis[k], self.axis[k + 1], int(self._program.head.slave)
        if self._events is not None:
            self._events.go_on(until)
        rows = self._rest(t, until, first, _STOPS[self._program.head.stop])
        return rows if self._events is None else self._events.end(until, rows)

    def _rest(self, t: float, until: float, first: int, stop: Stop) -> Sequence[Row]:
        """What is left of the way from `t` to `until` [s] that the stepper has left at place `first`."""
        balises = self.system.balises
        if stop is Stop.TURN:
            self._turns.raise_failure()
        if balises is not None:
            balises.begin(t, until)
        for place, step in enumerate(self.plan.steps[first:]):
            if place > 0:
                step.step(t, until)
            elif stop is not Stop.TURN:  # else it has been moved
                if step.interpolator is not None:
                    step.prepare(t, until)
                self._repeated_move(step.move, t, until)
        return NO_ROWS if balises is None else balises.rows()

    def _part(self, t: float, until: float) -> Sequence[Row] | None:
        """Bring the system from `t` to `until` [s] where nothing is due on the way; None where Python must."""
        if self._repetition.active or self._parts is None or not self._parts.may_begin(t, until):
            return None
        if self._crossings is not None:
            if self._crossings.recorded and self._crossings.idle_until <= until + 2.0 * TIME_TOLERANCE:
                return None
            self._crossings.allow(self._plain)
        head = self._program.head
        rows = int(self._library.stepper_part(self._address, t, until, self._parts.rows.ctypes.data))
        self._seconds += head.seconds
        if rows < 0 and head.stop == Stop.NEAR:
            return None
        if rows < 0 and head.stop == Stop.HANDED:
            with self._repetition.of(self._program.journalled()):
                return self.system.move(t, until)
        first = len(self._components) if rows >= 0 else int(head.slave)
        for place in self._own:
            self._components[place].time = until if place < first else t
        self._forget_repeated()
        if rows < 0:
            return self._rest(t, until, first, _STOPS[head.stop])
        if self._crossings is not None:
            self._crossings.collect()
        return [(float(row[0]), row[1:].copy()) for row in self._parts.rows[:rows]]

    def _quicken(self, place: int, step: PlannedComponent) -> None:
        """In the steps that are Python's a component still moves by one call into the stepper."""
        component, moves, slave = step.component, self._moves[place], self._program.slaves[place]
        call, address = self._library.stepper_move, self._address

        def move(reads: bool, slowly: Mover, t: float, until: float) -> None:
            if self._repetition.active or component.next_event <= until + 2.0 * TIME_TOLERANCE:
                slowly(t, until)
                return
            begin = perf_counter()
            if call(address, place, t, until, reads):
                component.time = until
                component.calls += 1 + slave.returns_here
                moves["set"] += 1
                moves["get"] += reads
                component.seconds += perf_counter() - begin
            else:
                self._repeated_move(slowly, t, until)

        drive, advance = partial(partial, move, True), partial(partial, move, False)
        step.add_stage(Stage(Position.COMPILED, COMPILED_STAGE_TEXT, drive=drive, advance=advance))

    def _watch_events(self) -> tuple[list[Component], Coordination | None]:
        """The components whose events known beforehand end a chunk, and what is to be known of those that concern
        others.
        """
        self._events: EventCoordinator | None = getattr(self.system, "events", None)
        self._parts: Parts | None = None
        own = [self._components[place] for place in self._own]
        if self._events is None:
            return own, None
        if all(step.every == 1 and step.interpolator is None for step in self.plan.steps):
            self._parts = Parts(self._components, self.system, self._events)
        taking_part = [p.component for p in self._events.participants if p.component not in own]
        wanted = self.system.meets_events
        return own + taking_part, Coordination(self._program, self.plan, self._events) if wanted else None

    def _watch_balises(self) -> Crossings | None:
        """The stepper knows of the balises; receivers that allow it are stepped through a telegram by one call into
        it.
        """
        service = self.system.balises
        if service is None:
            return None
        if not isinstance(service.localiser, RollbackLocaliser | RecordedLocaliser):
            raise NotCompilable(f"balises are localised by '{service.localiser.method}'")
        names, deliveries = [step.component.name for step in self.plan.steps], {}
        if (reason := self._program.in_python.get(names.index(service.plant))) is not None:
            raise NotCompilable(f"its balises are looked for, and {reason}")
        for receiver in service.receivers:
            place = names.index(receiver.planned.component.name)
            if place not in self._program.in_python and can_be_notified(receiver, place, self._program):
                deliveries[place] = CompiledDelivery(receiver, place, self._program, self._library, self._repetition)
                receiver.compiled = deliveries[place].step
        return Crossings(self._program, self.plan, self.axis, service, deliveries)

    def _repeated_move(self, move: Mover, t: float, until: float) -> None:
        """Move a component in Python that the stepper has moved in part."""
        head = self._program.head
        with self._repetition.of({int(head.slave): self._program.said(head.slave, Stop(head.stop))}):
            move(t, until)

    def _set_times(self, k: int) -> None:
        """Where the components stand after a chunk that ended in step number `k`; one call there is Python's to
        count.
        """
        head, within = self._program.head, self._program.head.stop in WITHIN
        for place in self._own:
            step = self.plan.steps[place]
            step.component.time = stands(step, self.axis, k + 1 if within and place < head.slave else k)
        self._forget_repeated()

    def _forget_repeated(self) -> None:
        """Calls that Python repeats are counted there."""
        head = self._program.head
        if head.stop in STEPPED:
            self._program.slaves[head.slave].calls -= 1
            self._program.slaves[head.slave].returns -= head.return_count

    def summary(self, stepping: float) -> dict[str, Any]:
        """Once it is closed, the ``share`` of the calls of doStep and of the seconds of stepping that were its own.

        Args:
            stepping: what all steps took [s].
        """
        seconds = self._seconds / stepping if stepping > 0.0 else None
        return {"share": {"steps": self._share_of_steps, "seconds": seconds}}

    def close(self) -> None:
        """Add what was done here to the counters of the components."""
        done = 0
        if self._crossings is not None:
            self._crossings.close()
        for place, (step, slave, moves) in enumerate(
            zip(self.plan.steps, self._program.slaves, self._moves, strict=True)
        ):
            for kind, count in moves.items():
                step.component.call_statistics[kind].add(0.0, count)
                moves[kind] = 0
            component, calls, over = step.component, slave.calls + slave.all_calls, self._program.head.balises.steps
            here = int(calls + slave.more_calls + slave.returns)
            done, component.calls = done + here, component.calls + here
            for kind in ("get", "set") if len(step.inputs) else ("get",):
                component.call_statistics[kind].add(
                    0.0, calls + slave.more_calls
                )  # so short in C that only doStep is timed
            self._program.hand_over_warnings(place, component)
            component.seconds += slave.seconds_over
            component.seconds += max(calls - over, 0) * typical_seconds(slave.sampled_calls, slave.sampled_seconds)
            slave.calls = slave.all_calls = slave.more_calls = slave.returns = 0
        self._share_of_steps = done / max(sum(c.calls for c in self._components), 1)
        self._seconds -= self._turns.seconds
        if self._coordination is not None:
            self._coordination.close(self.steps)


def _load() -> Any:
    try:
        return load_stepper()
    except (CompilerMissing, CompilationError, OSError) as error:
        raise NotCompilable(f"the stepper cannot be compiled here: {error}") from error
