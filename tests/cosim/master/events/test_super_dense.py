"""Events that reach others: at the same instant, in super-dense time, with what returns early taken back and redone."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from clocked_mocks import Clocked, Flag, Planned
from coupled_runs import Balises, Listener, Motion, Pushed, block, positions
from event_runs import EventRun, parts, prepare, run
from hypothesis import given, settings
from hypothesis import strategies as st
from mock_slaves import FMI2, Counter, EventMode, Mock, component
from test_fmus.events import (
    INSTANTS,
    NEVER_SETTLES,
    awkward_fmu,
    bouncer_fmu,
    bouncing_pair,
    countdown_fmu,
    crossing_times,
    integrator_fmu,
    periodic_fmu,
    receiver_fmu,
    timed_fmu,
    timed_integral,
    triggered_fmu,
)

from cosim.balises.telegram import Channel
from cosim.components.component import Component
from cosim.errors import RunError
from cosim.master.algorithms.jacobi import Jacobi
from cosim.master.control.doubling import DoublingStep
from cosim.master.master import close

ULPS = 1e-14
"""A few roundings of times of about 1 s."""

WIRES = ["s.crossing -> r.tick", "s.crossing_value -> r.tick_value"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("super_dense")


def rows_at(seen: EventRun, time: float) -> np.ndarray:
    return np.flatnonzero(np.abs(seen.time - time) < 1e-9)


# -- at the same instant
# ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", [1, 2, 3])
@given(step=st.tuples(st.floats(0.011, 0.3), st.integers(3, 20)))
@settings(max_examples=10)
def test_whoever_integrates_a_discrete_value_does_so_from_the_exact_instant(
    folder: Path, version: Any, step: tuple[float, int]
) -> None:
    h, count = step
    seen = run(
        parts(s=timed_fmu(folder), i=integrator_fmu(folder, f"integrator{version}", version=version)),
        ["s.level -> i.u"],
        h,
        count,
    )
    # 4 jumps of 4 at most, 1e-9 s each
    assert seen.end("i.integral") == pytest.approx(timed_integral(h * count), abs=2e-8)


def test_left_local_the_jump_arrives_at_the_communication_point_and_the_loss_shows(folder: Path) -> None:
    """Jumps at 0.07, 0.255, 0.4, 0.7123 s; stepped after the source, the integrator feels them from 0, 0.2, 0.3, 0.7 s
    on.
    """
    wires, components = ["s.level -> i.u"], lambda: parts(s=timed_fmu(folder), i=integrator_fmu(folder))
    together, alone = run(components(), wires, 0.1, 10), run(components(), wires, 0.1, 10, events="local")
    assert together.end("i.integral") == pytest.approx(timed_integral(1.0), abs=ULPS)
    assert alone.end("i.integral") == pytest.approx(timed_integral(1.0, (0.0, 0.2, 0.3, 0.7)), abs=ULPS)
    assert alone.end("i.integral") - together.end("i.integral") == pytest.approx(0.27425, abs=1e-9)


def test_two_rows_before_and_after_each_event_within_a_step_and_at_its_end(folder: Path) -> None:
    seen = run(parts(s=timed_fmu(folder), i=integrator_fmu(folder)), ["s.level -> i.u"], 0.1, 10)
    for instant, before, after in zip(INSTANTS, (1.0, 2.0, -1.0, 3.0), (2.0, -1.0, 3.0, 0.5), strict=True):
        assert seen["s.level"][rows_at(seen, instant)].tolist() == [before, after]
        assert len(np.unique(seen["i.integral"][rows_at(seen, instant)])) == 1
    assert len(seen.time) == 11 + 2 * 3 + 1  # 0.4 s is a communication point: one row more


def test_a_chain_passes_a_change_on_within_one_instant(folder: Path) -> None:
    """A kicked component, two that add 1, an integrator at the end: y = 1, 2, 3 at 0.15 s."""
    head, link = bouncer_fmu(folder, "head", add=0.0, kick_time=0.15), bouncer_fmu(folder, "link", add=1.0)
    wires = ["a.y -> b.u", "b.y -> c.u", "c.y -> d.u"]
    seen = run(parts(a=head, b=link, c=link, d=integrator_fmu(folder)), wires, 0.1, 5)
    for name, value in (("a.y", 1.0), ("b.y", 2.0), ("c.y", 3.0)):
        assert seen.jumps(name) == [0.15]
        assert seen.end(name) == value
    assert seen.end("d.integral") == pytest.approx(3.0 * 0.35, abs=ULPS)
    assert seen.master.system.events is not None
    assert seen.master.system.events.iteration.count == 1


def test_the_order_of_listing_does_not_matter(folder: Path) -> None:
    made = {
        "s": triggered_fmu(folder),
        "r": receiver_fmu(folder),
        "t": timed_fmu(folder),
        "i": integrator_fmu(folder),
        "c": countdown_fmu(folder),
    }
    wires = [*WIRES, "t.level -> i.u", "s.crossing -> c.start"]
    reference = None
    for order in list(itertools.permutations(made))[::17]:
        seen = run(parts(**{name: made[name] for name in order}), wires, 0.1, 10)
        reference = reference or seen
        for name in reference.table.dtype.names:
            np.testing.assert_array_equal(seen[name], reference[name])


@pytest.mark.parametrize("rounds", [1, 5, 40])
def test_an_exchange_settles_after_its_rounds(folder: Path, rounds: int) -> None:
    ping, pong = bouncing_pair(folder / str(rounds), rounds)
    seen = run(parts(ping=ping, pong=pong), ["ping.y -> pong.u", "pong.y -> ping.u"], 0.1, 4)
    assert [seen.end(f"{name}.y") for name in ("ping", "pong")] == [rounds, rounds]
    assert seen.end("ping.changes") == rounds
    assert seen.jumps("ping.y") == seen.jumps("pong.y") == [0.15]


def test_an_exchange_without_end_is_an_error_that_names_who_and_what(folder: Path) -> None:
    ping, pong = bouncing_pair(folder / "never", NEVER_SETTLES)
    master = prepare(parts(ping=ping, pong=pong), ["ping.y -> pong.u", "pong.y -> ping.u"], 0.1, 4)
    with pytest.raises(RunError, match=r"t = 0.15 s do not settle in 100 rounds") as caught:
        master.run()
    close(master.plan)
    assert all(part in str(caught.value) for part in ("ping.y", "pong.y", "components: ping, pong"))
    assert master.recorder.table()["time"].tolist() == [0.0, 0.1]


def test_discrete_inputs_change_in_event_mode_only() -> None:
    """An FMI 2 source changes its output at communication points; the listener refuses discrete inputs in Step Mode."""

    class Stairs(FMI2, Mock):
        outputs: ClassVar[dict[str, Any]] = {"y": 0.0}

        def compute(self) -> None:
            self.v["y"] = math.floor(self.time / 0.3 + 1e-9)

    flag = Flag()
    run([component(Stairs(), "a"), component(flag, "b")], ["a.y -> b.u"], 0.1, 10)
    assert [value for _, value in flag.seen] == [1.0, 2.0, 3.0]
    np.testing.assert_allclose([time for time, _ in flag.seen], [0.3, 0.6, 0.9], rtol=0.0, atol=ULPS)


# -- taken back and redone
# ----------------------------------------------------------------------------------------------


def test_a_redone_step_leaves_no_trace(folder: Path) -> None:
    """Bit-identical with a run in which the same instants were announced beforehand and nothing had to be taken
    back.
    """
    level = 0.173
    instants = tuple(level * k for k in range(1, 6))
    reported = timed_fmu(folder, "reported", instants=instants, levels=(1.0, 2.0, 3.0, 4.0, 5.0), first=0.0)

    def bystanders() -> list[Component]:
        return [
            block(Motion(), "plant"),
            block(Listener(), "listener"),
            *parts(i=integrator_fmu(folder)),
        ]

    wires = ["s.{} -> i.u", "plant.speed -> listener.speed"]
    unknown = run([*bystanders(), *parts(s=triggered_fmu(folder))], [w.format("count") for w in wires], 0.1, 10)
    known = run([*bystanders(), *parts(s=reported)], [w.format("level") for w in wires], 0.1, 10)
    assert unknown.master.system.events is not None
    assert unknown.master.system.events.redone == 5
    assert known.master.system.events is not None
    assert known.master.system.events.redone == 0
    np.testing.assert_array_equal(unknown.time, known.time)
    for name in ("plant.position", "listener.integrated", "i.integral"):
        np.testing.assert_array_equal(unknown[name], known[name])


def test_nobody_is_taken_back_where_nothing_is_connected(folder: Path) -> None:
    slave = Counter()
    saves: list[float] = []
    slave.getFMUState = lambda: saves.append(slave.time)  # type: ignore[method-assign,assignment]
    seen = run([*parts(s=triggered_fmu(folder)), component(slave, "c")], [], 0.1, 10)
    np.testing.assert_allclose(seen["s.when"][seen["s.count"] > 0][[0, -1]], crossing_times(1.0)[[0, -1]], atol=ULPS)
    assert seen.master.system.events is None
    assert not saves


def test_an_observer_in_a_loop_that_is_only_notified_of_balises_needs_no_coordinator() -> None:
    """Its Event Mode serves telegrams only: nothing is added to the steps of such loops, and they may be compiled."""
    wires = ["plant.speed -> listener.speed", "listener.heard -> c.rate"]
    components = [block(Motion(), "plant"), block(Listener(), "listener"), component(Counter(), "c")]
    assert components[1].capabilities.hasEventMode
    seen = run(components, wires, 0.1, 10, balises=Balises(positions(5.0), receivers=["listener"]))
    assert seen.master.system.events is None
    assert seen.end("listener.heard") == 1.0


@pytest.mark.parametrize("first", [True, False])
def test_who_cannot_save_its_state_stays_where_it_is_and_is_noted(folder: Path, first: bool) -> None:
    class Sealed(Counter):
        capabilities: ClassVar[dict[str, Any]] = {"canGetAndSetFMUstate": False}

        def getFMUState(self) -> Any:
            raise AssertionError("its state was asked for")

        def move(self, t: float, h: float) -> None:
            super().move(t, h)
            reached.append(t + h)

    reached: list[float] = []
    sealed = component(Sealed(), "sealed")
    others = parts(s=triggered_fmu(folder), r=receiver_fmu(folder))
    seen = run([*others, sealed], WIRES, 0.1, 10, order=["sealed", "s", "r"] if first else ["s", "r", "sealed"])
    assert seen.end("sealed.total") == pytest.approx(1.0, abs=ULPS)
    np.testing.assert_allclose(seen.jumps("r.when"), crossing_times(1.0), rtol=0.0, atol=ULPS)
    assert reached == sorted(reached)
    assert len(reached) == (10 if first else 15)  # stepped before the source, it is past the event when that is met
    assert seen.master.system.events is not None
    assert any("sealed" in note and "not taken back" in note for note in seen.master.system.events.notes)


def test_a_source_that_cannot_save_its_state_waits_for_the_others() -> None:
    class Once(EventMode):
        capabilities: ClassVar[dict[str, Any]] = EventMode.capabilities | {"canGetAndSetFMUstate": False}
        outputs: ClassVar[dict[str, Any]] = {"y": 0.0}
        ahead = True

        def begin(self) -> None:
            super().begin()
            self.x["met"] = 0.0

        def compute(self) -> None:
            self.v["y"] = self.x["events"]

        def doStep(self, t: float, h: float) -> tuple[bool, bool, bool, float]:
            if not self.x["met"] and t < 0.25 <= t + h:
                self.x["met"] = 1.0
                self.time = 0.25
                return True, False, True, 0.25
            return super().doStep(t, h)

    for order in (0, 1):
        total = Counter()
        components = [component(total, "c"), component(Once(), "s")]
        seen = run(components[::-1] if order else components, ["s.y -> c.rate"], 0.1, 10)
        assert seen.jumps("s.y") == [0.25]
        assert seen.end("c.total") == pytest.approx(0.75, abs=1e-12)


def test_who_takes_whole_steps_only_gets_values_at_the_next_point_and_is_noted(folder: Path) -> None:
    class Stiff(Counter):
        capabilities: ClassVar[dict[str, Any]] = {"canHandleVariableCommunicationStepSize": False}

        def move(self, t: float, h: float) -> None:
            assert h == pytest.approx(0.1, abs=1e-9)
            super().move(t, h)

    seen = run([*parts(s=timed_fmu(folder)), component(Stiff(), "c")], ["s.level -> c.rate"], 0.1, 10)
    assert seen.jumps("s.level") == list(INSTANTS)
    assert seen.end("c.total") == pytest.approx(timed_integral(1.0, (0.0, 0.2, 0.4, 0.7)), abs=1e-12)
    assert seen.master.system.events is not None
    assert seen.master.system.events.notes == [
        "Cannot vary the communication step, so events between two communication points reach them at the later one: c."
    ]


# -- with everything else
# -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["rollback", "predict", "interpolate"])
@given(places=st.lists(st.floats(0.1, 13.0), min_size=1, max_size=6, unique=True), latency=st.sampled_from([0.0, 0.03]))
@settings(max_examples=8)
def test_balises_are_delivered_once_whatever_events_divide_the_step(
    folder: Path, method: Any, places: list[float], latency: float
) -> None:
    """The same telegrams at the same instants as without the component that returns early in the same steps."""
    layout = positions(*sorted(places))

    def telegrams(with_events: bool) -> EventRun:
        balises = Balises(layout, receivers=["listener"], method=method, channel=Channel(latency=latency))
        events = parts(s=triggered_fmu(folder), r=receiver_fmu(folder)) if with_events else []
        components = [block(Motion(), "plant"), block(Listener(), "listener"), *events]
        return run(
            components, ["plant.speed -> listener.speed", *(WIRES if with_events else [])], 0.1, 10, balises=balises
        )

    divided, whole = telegrams(True), telegrams(False)
    logs = [seen.master.balises.mailbox.log for seen in (divided, whole)]  # type: ignore[union-attr]
    assert [e.identity for e in logs[0]] == [e.identity for e in logs[1]]
    for field in ("stamp", "delivered_at"):
        ours, theirs = ([getattr(e, field) for e in log] for log in logs)
        np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=1e-8)
    assert divided.end("listener.heard") == whole.end("listener.heard") == len(logs[0])
    assert divided.end("r.count") == 5.0
    assert np.all(np.diff(divided.time) >= 0.0)


def test_a_receiver_of_whole_steps_is_notified_of_what_was_passed_in_every_part_of_it(folder: Path) -> None:
    listener = block(Listener(), "listener")
    object.__setattr__(listener.capabilities, "canHandleVariableCommunicationStepSize", False)
    speed, divided_at = 13.9, crossing_times(1.0)  # steps from 0.1 s and from 0.3 s are divided at 0.173 s and 0.346 s
    passed = (0.12, 0.32, 0.36, 0.5)
    assert passed[0] < divided_at[0]
    assert passed[1] < divided_at[1] < passed[2]
    balises = Balises(positions(*(speed * t for t in passed)), receivers=["listener"])
    components = [block(Motion(), "plant"), listener, *parts(s=triggered_fmu(folder), r=receiver_fmu(folder))]
    seen = run(components, ["plant.speed -> listener.speed", *WIRES], 0.1, 10, balises=balises)
    assert seen.end("listener.heard") == len(passed)
    assert seen.end("listener.last") == pytest.approx(speed * passed[-1])
    log = seen.master.balises.mailbox.log  # type: ignore[union-attr]
    np.testing.assert_allclose([e.stamp for e in log], passed, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(
    "how",
    [
        {"algorithm": Jacobi},
        {"algorithm": lambda plan: Jacobi(plan, threads=2)},
        {"control": lambda system: DoublingStep(system, 1e-6)},
    ],
)
def test_events_are_hit_whatever_algorithm_and_step_control(folder: Path, how: dict[str, Any]) -> None:
    components = parts(s=triggered_fmu(folder), r=receiver_fmu(folder), c=countdown_fmu(folder), p=periodic_fmu(folder))
    seen = run([*components, block(Pushed(), "plant")], [*WIRES, "s.ramp -> plant.push"], 0.1, 10, **how)
    np.testing.assert_allclose(seen.jumps("r.when"), crossing_times(1.0), rtol=0.0, atol=ULPS)
    np.testing.assert_allclose(seen.jumps("c.alarms"), [0.347], rtol=0.0, atol=ULPS)
    assert (seen.end("r.count"), seen.end("p.count")) == (5.0, 34.0)


# -- the end of the run
# -------------------------------------------------------------------------------------------------


def test_a_request_to_terminate_ends_the_run_with_everybody_at_that_time(folder: Path) -> None:
    """Asked for in an event, and in a step that others are then taken back from."""
    quitting = awkward_fmu(folder, "quit-in-event", at=0.25)
    seen = run([*parts(q=quitting, i=integrator_fmu(folder)), component(Counter(), "c")], ["q.y -> i.u"], 0.1, 10)
    assert seen.time[-1] == 0.25
    assert seen.end("c.total") == pytest.approx(0.25, abs=ULPS)
    assert seen.master.ended_early == "Component 'q' asked to terminate at t = 0.25 s."
    leaving = awkward_fmu(folder, "quit", "leaving", at=0.25)
    mixed = [component(Counter(), "c"), *parts(q=leaving, s=triggered_fmu(folder), r=receiver_fmu(folder))]
    seen = run(mixed, WIRES, 0.1, 10)
    assert seen.time[-1] == 0.25
    assert seen.end("c.total") == pytest.approx(0.25, abs=ULPS)
    assert seen.end("q.y") == pytest.approx(0.25, abs=ULPS)
    assert seen.end("r.count") == 1.0


def test_all_who_ask_for_the_end_are_named(folder: Path) -> None:
    quitting = awkward_fmu(folder, "quit-in-event", at=0.25)
    wires = ["a.y -> i.u", "b.y -> j.u"]
    seen = run(parts(a=quitting, b=quitting, i=integrator_fmu(folder), j=integrator_fmu(folder)), wires, 0.1, 10)
    assert seen.master.ended_early == "Components 'a' and 'b' asked to terminate at t = 0.25 s."


# -- bad answers
# --------------------------------------------------------------------------------------------------------


def planned(plan: Callable[[float, int], float], h: float = 0.1, count: int = 10) -> tuple[list[float], EventRun]:
    slave = Planned(plan)
    seen = run([component(slave, "s"), component(Counter(), "c")], ["s.events -> c.rate"], h, count)
    return slave.seen, seen


@pytest.mark.parametrize("error", [0.0, 4e-10, -4e-10])
def test_an_event_at_a_communication_point_happens_once(error: float) -> None:
    times, seen = planned(lambda _t, n: 0.3 + error if n == 0 else math.inf)
    assert len(times) == 1
    assert times[0] == pytest.approx(0.3, abs=1e-9)
    assert seen["s.events"][rows_at(seen, 0.3)].tolist() == [0.0, 1.0]
    assert seen.end("c.total") == pytest.approx(0.7, abs=1e-9)


def test_instants_that_differ_by_rounding_are_one() -> None:
    slaves = [Planned(lambda _t, n, e=e: 0.25 + e if n == 0 else math.inf) for e in (0.0, 5e-10)]
    run(
        [component(s, f"s{i}") for i, s in enumerate(slaves)] + [component(Counter(), "c")],
        ["s0.events -> c.rate"],
        0.1,
        10,
    )
    assert slaves[0].seen == [0.25]
    wires = ["s0.events -> c.rate", "s1.events -> d.rate"]
    slaves = [Planned(lambda _t, n, e=e: 0.25 + e if n == 0 else math.inf) for e in (0.0, 5e-10)]
    seen = run(
        [*(component(s, f"s{i}") for i, s in enumerate(slaves)), component(Counter(), "c"), component(Counter(), "d")],
        wires,
        0.1,
        10,
    )
    assert [s.seen for s in slaves] == [[0.25], [0.25]]
    assert len(rows_at(seen, 0.25)) == 2


def test_an_event_time_in_the_past_happens_now_and_for_ever_is_an_error() -> None:
    times, _ = planned(lambda _t, n: (0.25, 0.1, math.inf)[min(n, 2)])
    assert times == [0.25]  # once in Event Mode for both
    with pytest.raises(RunError, match=r"t = 0.25 s do not settle in 100 rounds; .*s.events"):
        planned(lambda _t, _n: 0.25)


def test_an_event_time_that_is_no_number_is_an_error() -> None:
    class Lost(Planned):
        def updateDiscreteStates(self) -> tuple[bool, bool, bool, bool, bool, float]:
            return False, False, False, False, True, 0.25 if self.time < 0.2 else math.nan

    with pytest.raises(RunError, match=r"Component 's' at t = 0.25 s: .* next event is at t = nan"):
        run([component(Lost(lambda _t, _n: math.inf), "s"), component(Counter(), "c")], ["s.events -> c.rate"], 0.1, 10)


def test_returning_early_at_once_for_ever_is_an_error() -> None:
    class Stuck(EventMode):
        outputs: ClassVar[dict[str, Any]] = {"y": 0.0}

        def doStep(self, t: float, h: float) -> tuple[bool, bool, bool, float]:
            if t + h > 0.25:
                self.time = max(0.25, t)
                return True, False, True, self.time
            return super().doStep(t, h)

    with pytest.raises(RunError, match=r"Time stands still at t = 0.25 s: 100 events .* components with events: s"):
        run([component(Stuck(), "s"), component(Counter(), "c")], ["s.y -> c.rate"], 0.1, 10)


def test_events_at_the_start_are_seen_in_the_first_row() -> None:
    slave = Clocked("constant", intervalDecimal=0.25)
    seen = run([component(slave, "s"), component(Counter(), "c")], ["s.ticks -> c.rate"], 0.1, 5)
    assert seen["s.ticks"][0] == 1.0
    # the tick at 0.5 s comes with the last point
    assert seen.end("c.total") == pytest.approx(0.25 + 2 * 0.25, abs=ULPS)
