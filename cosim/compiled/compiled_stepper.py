"""Chunks: communication steps that the compiled stepper does in one call, and the way back to Python where one is
odd.

A chunk ends at a row of events that Python knows beforehand (a telegram, an instant, a time event), and at whatever
the stepper
meets: then the Python stepper finishes the step from where it stands.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial
from operator import attrgetter
from time import perf_counter
from typing import Any

from cosim.balises.recorded import RecordedLocaliser
from cosim.balises.rollback import RollbackLocaliser
from cosim.compiled.crossings import Crossings
from cosim.compiled.library import load_stepper
from cosim.compiled.notifying import CompiledDelivery, can_be_notified
from cosim.compiled.program import NotCompilable, Program, Stop
from cosim.compiled.recorded_returns import RecordedReturn, repeated
from cosim.compiled.recordings import follows_recordings
from cosim.components.component import Component
from cosim.components.recording import RecordingSlave
from cosim.coupling.chain import COMPILED_STAGE_TEXT, Mover, Position, Stage
from cosim.coupling.plan import Plan
from cosim.coupling.planned import PlannedComponent
from cosim.diagnostics.sampled_times import typical_seconds
from cosim.master.axis import TimeAxis
from cosim.master.control.control import StepControl
from cosim.master.control.fixed import FixedStep
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

WITHIN = frozenset({Stop.REFUSED, Stop.WRITE, Stop.STEP, Stop.READ, Stop.ARRIVE, Stop.CROSSED})
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

    `steps` counts what it did.

    Raises:
        NotCompilable: why it cannot.
    """

    def __init__(self, control: StepControl, axis: TimeAxis) -> None:
        self.control, self.axis = control, axis
        self.system: System = control.system
        self.plan: Plan = self.system.plan
        self.steps = 0
        self._components = [step.component for step in self.plan.steps]
        self._moves = [{"get": 0, "set": 0} for _ in self.plan.steps]
        self._longest = 1
        _check(control, self.system)
        self._library = _load()
        self._program = Program(self.plan, axis, self._library)
        self._program.head.seconds_at_most = SECONDS
        self._address = self._program.address
        self._repeating = False
        for place, step in enumerate(self.plan.steps):
            if step.interpolator is None:
                self._quicken(place, step)
        self._crossings = self._watch_balises()
        self._first: int | None = None
        self._stops_at_packets = False
        for place, step in enumerate(self.plan.steps):
            step.component.clock = partial(self._time_in_chunk, place, step.component)

    def run(self, k: int, recorder: Recorder) -> Chunk:
        """Do steps from number `k` on.

        Raises:
            OutputError: the recorder takes no more rows.
        """
        own_crossings = self._crossings is not None and self._crossings.allow(recorder.every == 1)
        self._stops_at_packets = recorder.every == 1
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
        self.steps += done
        if self._crossings is not None:
            self._crossings.collect()
        self._set_times(k + done)
        if done == wanted and self._stops_at_packets:
            self._pass_packets(self.axis[k + done], recorder)
        if done:
            fitting = int(self._longest * SECONDS / max(head.seconds, 1e-9))
            self._longest = max(1, min(fitting, GROWTH * self._longest, LONGEST))
        return self._ended(k, done, _STOPS[head.stop])

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
        limit = min(map(_NEXT_EVENT, self._components), default=NEVER)
        if any(map(_TERMINATED, self._components)):
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
        with self._repeated(said):
            return self._whole_step(k)

    def _rest_of_step(self, k: int) -> Sequence[Row]:
        """What is left of step `k` once the stepper, which has begun it, has left it at one of the slaves."""
        t, until, balises, first = self.axis[k], self.axis[k + 1], self.system.balises, int(self._program.head.slave)
        if balises is not None:
            balises.begin(t, until)
        for place, step in enumerate(self.plan.steps[first:]):
            if place == 0:
                if step.interpolator is not None:
                    step.prepare(t, until)
                self._repeated_move(step.move, t, until)
            else:
                step.step(t, until)
        rows = NO_ROWS if balises is None else balises.rows()
        return [*rows, *self._packets_at_end(until)]

    def _packets_at_end(self, t: float) -> Sequence[Row]:
        """What is sent or arrives at the end of a step that the stepper has left, and the row before it."""
        network, values = self.system.network, self.plan.values
        if network is None or not network.is_due(t):
            return NO_ROWS
        before = values.copy()
        network.handle(t)
        return [(t, before)] if before.tobytes() != values.tobytes() else NO_ROWS

    def _quicken(self, place: int, step: PlannedComponent) -> None:
        """In the steps that are Python's a component still moves by one call into the stepper."""
        component, moves, slave = step.component, self._moves[place], self._program.slaves[place]
        call, address = self._library.stepper_move, self._address

        def move(reads: bool, slowly: Mover, t: float, until: float) -> None:
            if self._repeating or component.next_event <= until + 2.0 * TIME_TOLERANCE:
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
        for receiver in service.receivers:
            place = names.index(receiver.planned.component.name)
            if can_be_notified(receiver, place, self._program):
                idle = lambda: not self._repeating  # noqa: E731 - one word of state
                deliveries[place] = CompiledDelivery(
                    receiver, place, self._program, self._library, self._repeated, idle
                )
                receiver.compiled = deliveries[place].step
        return Crossings(self._program, self.plan, self.axis, service, deliveries)

    def _repeated_move(self, move: Mover, t: float, until: float) -> None:
        """Move a component in Python that the stepper has moved in part."""
        head = self._program.head
        with self._repeated({int(head.slave): self._program.said(head.slave, Stop(head.stop))}):
            move(t, until)

    @contextmanager
    def _repeated(self, responses: Mapping[int, Mapping[str, Sequence[RecordedReturn]]]) -> Iterator[None]:
        """Python is at work on a step that the stepper has begun: slaves repeat themselves, and nobody calls the
        stepper.
        """
        self._repeating = True
        try:
            with ExitStack() as stack:
                for place, said in responses.items():
                    slave = self.plan.steps[place].component.slave
                    if not isinstance(slave, RecordingSlave):  # which goes to any time, whatever it was asked before
                        stack.enter_context(repeated(slave, said))
                yield
        finally:
            self._repeating = False

    def _set_times(self, k: int) -> None:
        """Where the components stand after a chunk that ended in step number `k`; one call there is Python's to
        count.
        """
        head, t = self._program.head, self.axis[k]
        for step in self.plan.steps:
            step.component.time = t
        if head.stop in WITHIN:
            for step in self.plan.steps[: head.slave]:
                step.component.time = self.axis[k + 1]
            if head.stop in STEPPED:  # Python counts them when they are repeated
                self._program.slaves[head.slave].calls -= 1
                self._program.slaves[head.slave].returns -= head.return_count

    def close(self) -> None:
        """Add what was done here to the counters of the components."""
        if self._crossings is not None:
            self._crossings.close()
        for place, (step, slave, moves) in enumerate(
            zip(self.plan.steps, self._program.slaves, self._moves, strict=True)
        ):
            for kind, count in moves.items():
                step.component.call_statistics[kind].add(0.0, count)
                moves[kind] = 0
            component, calls, over = step.component, slave.calls + slave.all_calls, self._program.head.balises.steps
            component.calls += calls + slave.more_calls + slave.returns
            for kind in ("get", "set") if len(step.inputs) else ("get",):
                component.call_statistics[kind].add(
                    0.0, calls + slave.more_calls
                )  # so short in C that only doStep is timed
            self._program.hand_over_warnings(place, component)
            component.seconds += slave.seconds_over
            component.seconds += max(calls - over, 0) * typical_seconds(slave.sampled_calls, slave.sampled_seconds)
            slave.calls = slave.all_calls = slave.more_calls = slave.returns = 0


def _load() -> Any:
    try:
        return load_stepper()
    except (CompilerMissing, CompilationError, OSError) as error:
        raise NotCompilable(f"the stepper cannot be compiled here: {error}") from error


def _check(control: StepControl, system: System) -> None:
    if type(control) is not FixedStep:
        raise NotCompilable(f"the step control '{control.name}' is Python's")
    if system.meets_events:
        raise NotCompilable("events of the components are propagated")
    algorithm = system.algorithm
    if algorithm.name not in ("gauss-seidel", "jacobi") or getattr(algorithm, "threads", 1) != 1:
        raise NotCompilable(f"the algorithm '{algorithm.name}' is Python's")
    for step in system.plan.steps:
        if step.inputs.gated and len(step.inputs):
            raise NotCompilable(f"inputs of {step.component.name} are sent by something in Python")
        if any(stage.position not in (Position.BALISES, Position.COMPILED) for stage in step.stages):
            raise NotCompilable(f"{step.component.name} is moved by something in Python")
        if step.inputs.non_numeric is not None:
            raise NotCompilable(
                f"inputs of {step.component.name} are no doubles: {', '.join(step.inputs.non_numeric.names)}"
            )
        if step.inputs.non_numeric is not None or len(system.plan.non_numeric):
            raise NotCompilable("values that are no doubles are passed on")
        if step.inputs.tables:
            raise NotCompilable(f"inputs of {step.component.name} are mapped by tables of values")
        if step.interpolator is not None and not follows_recordings(step.interpolator):
            raise NotCompilable(f"inputs of {step.component.name} follow lines between communication points")
        if step.substeps != 1:
            raise NotCompilable(f"{step.component.name} takes {step.substeps} steps for one")
