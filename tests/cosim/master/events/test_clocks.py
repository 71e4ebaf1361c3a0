"""Clocks: instants of every kind of clock, hit exactly whatever the communication step; connections between clocks."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from clocked_mocks import CHANGED, NOT_YET_KNOWN, UNCHANGED, Clocked, clock
from event_runs import parts, prepare, run
from hypothesis import given, settings
from hypothesis import strategies as st
from mock_slaves import Counter, component
from test_fmus.events import (
    DELAY,
    alarm_times,
    countdown_fmu,
    crossing_times,
    periodic_fmu,
    periodic_ticks,
    received_integral,
    receiver_fmu,
    timed_fmu,
    triggered_fmu,
)

import cosim
from cosim.components.loading import load_fmu
from cosim.coupling.clocks import connect_clocks
from cosim.coupling.connection import connect
from cosim.errors import CouplingError, RunError
from cosim.master.master import close
from fmus.fmi.clocks import Rhythm
from fmus.fmi.description import read_description

ULPS = 1e-14
"""A few roundings of times of about 1 s."""

EDGE = 2e-9
"""An event so near to the end of a run may count or not: twice the tolerance of communication times [s]."""

steps = st.tuples(st.floats(0.011, 0.3), st.integers(2, 25))
WIRES = ["s.crossing -> r.tick", "s.crossing_value -> r.tick_value"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("clocks")


def ticks_of(slave: Clocked, h: float = 0.07, count: int = 10, **how: Any) -> list[float]:
    run([component(slave, "c")], [], h, count, **how)
    return slave.seen


# -- instants of C examples
# ---------------------------------------------------------------------------------------------


@given(steps)
@settings(max_examples=20)
def test_a_periodic_clock_ticks_at_its_instants_whatever_the_step(folder: Path, step: tuple[float, int]) -> None:
    h, count = step
    seen = run(parts(p=periodic_fmu(folder)), [], h, count)
    sure, perhaps = periodic_ticks(h * count - EDGE), periodic_ticks(h * count + EDGE)
    assert len(sure) <= seen.end("p.count") <= len(perhaps)
    jumps = seen.jumps("p.when")
    np.testing.assert_allclose(jumps, perhaps[: len(jumps)], rtol=0.0, atol=EDGE)
    np.testing.assert_allclose(jumps[: len(sure) - 1], sure[:-1], rtol=0.0, atol=1e-9 + ULPS)


@pytest.mark.parametrize("h", [0.1, 0.07, 0.013])
def test_clock_instants_are_exact_to_rounding(folder: Path, h: float) -> None:
    seen = run(parts(p=periodic_fmu(folder)), [], h, round(0.91 / h))
    jumps = seen.jumps("p.when")
    np.testing.assert_allclose(jumps, periodic_ticks(0.91)[: len(jumps)], rtol=0.0, atol=ULPS)
    np.testing.assert_array_equal(seen["p.when"][np.searchsorted(seen.time, jumps, side="right") - 1], jumps)
    assert len(jumps) > 25


@given(steps)
@settings(max_examples=20)
def test_a_triggered_clock_takes_its_value_along_at_the_exact_instant(folder: Path, step: tuple[float, int]) -> None:
    """The source returns early where nobody expected it; the integral of the receiver tells the instants: sum level (t
    - t_k).
    """
    h, count = step
    seen = run(parts(s=triggered_fmu(folder), r=receiver_fmu(folder)), WIRES, h, count)
    # 17 crossings, each 1e-9 s at most
    assert seen.end("r.integral") == pytest.approx(received_integral(h * count), abs=1e-8)
    expected = crossing_times(h * count - EDGE)
    np.testing.assert_allclose(seen.jumps("r.when")[: len(expected)], expected, rtol=0.0, atol=1e-9)


def test_a_countdown_rings_its_delay_after_what_armed_it(folder: Path) -> None:
    """Armed by a time event of its own, again by every alarm, and by a clock of another component."""
    seen = run(parts(c=countdown_fmu(folder)), [], 0.1, 10, starts={"c": {"repeat": True}})
    np.testing.assert_allclose(seen.jumps("c.alarms"), alarm_times(1.0, repeat=True), rtol=0.0, atol=ULPS)
    wired = parts(s=triggered_fmu(folder, level=0.4), c=countdown_fmu(folder))
    seen = run(wired, ["s.crossing -> c.start"], 0.1, 10, starts={"c": {"arm_time": -1.0}})
    np.testing.assert_allclose(seen.jumps("c.alarms"), [0.4 + DELAY, 0.8 + DELAY], rtol=0.0, atol=ULPS)


def test_without_event_mode_the_loss_shows(folder: Path) -> None:
    """The same models without event mode, steps of 100 ms: 24 of 34 ticks are not seen apart, and the integral is 0.086
    off.

    The crossings at k 0.173 s, k = 1 ... 5, are seen at the ends of their steps and, stepped after the source, taken
    from the beginnings of these on: 0.1, 0.3, 0.5, 0.6, 0.8 s instead of 0.173, 0.346, 0.519, 0.692, 0.865 s.
    """
    source, sink = triggered_fmu(folder, "blind", event_mode=False), receiver_fmu(folder, "deaf", event_mode=False)
    seen = run(parts(s=source, r=sink), ["s.crossing_value -> r.tick_value"], 0.1, 10)
    early = crossing_times(1.0) - [0.1, 0.3, 0.5, 0.6, 0.8]
    assert seen.end("r.integral") - received_integral(1.0) == pytest.approx(0.173 * early.sum(), abs=1e-12)
    assert 0.05 < 0.173 * early.sum() < 0.06
    lost = run(parts(p=periodic_fmu(folder, "coarse", event_mode=False)), [], 0.1, 10)
    assert len(lost.jumps("p.when")) == 10
    assert len(periodic_ticks(1.0)) == 34


# -- kinds of clocks
# ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["constant", "fixed", "tunable"])
def test_declared_intervals_are_taken_from_the_description(kind: str) -> None:
    slave = Clocked(kind, intervalDecimal=0.11, shiftDecimal=0.05)
    expected = [0.05 + n * 0.11 for n in range(6)]
    np.testing.assert_allclose(ticks_of(slave), expected, rtol=0.0, atol=ULPS)
    assert slave.asked == 0


@given(st.floats(0.01, 0.5), st.floats(0.0, 0.4), st.floats(-10.0, 10.0))
@settings(max_examples=20)
def test_a_fixed_clock_is_asked_for_interval_and_shift(interval: float, shift: float, start: float) -> None:
    slave = Clocked("fixed", [(interval, CHANGED)], shift)
    seen = ticks_of(slave, 0.07, 10, start=start)
    expected = [start + (shift + n * interval) for n in range(1 + int((0.7 - shift - EDGE) / interval))]
    np.testing.assert_allclose(seen[: len(expected)], expected, rtol=0.0, atol=1e-9 + ULPS)
    assert slave.asked == 1


def test_a_fraction_is_counted_in_its_resolution() -> None:
    """Counters 1 of 3 after 1 of 6: at (1/6 + n/3) s, which no sum of decimals hits."""
    slave = Clocked("fixed", [(0.0, CHANGED)], supportsFraction=True)
    np.testing.assert_allclose(ticks_of(slave, 0.1, 20), [1 / 6 + n / 3 for n in range(6)], rtol=0.0, atol=ULPS)
    declared = Clocked("constant", supportsFraction=True, resolution=1000, intervalCounter=100, shiftCounter=0)
    assert ticks_of(declared, 1.0, 1) == [n * 100 / 1000 for n in range(11)]


def test_a_changing_clock_says_at_each_tick_when_the_next_one_comes() -> None:
    slave = Clocked("changing", [(0.05, CHANGED), (0.1, CHANGED), (0.2, CHANGED), (0.2, UNCHANGED)])
    np.testing.assert_allclose(ticks_of(slave), [0.05, 0.15, 0.35, 0.55], rtol=0.0, atol=ULPS)


def test_a_tunable_clock_counts_a_new_interval_from_the_event_that_changed_it() -> None:
    """FMI 3.0.2, table of qualifiers, (6)."""
    slave = Clocked("tunable", [(0.1, CHANGED), (0.1, UNCHANGED), (0.1, UNCHANGED), (0.25, CHANGED), (0.25, UNCHANGED)])
    np.testing.assert_allclose(ticks_of(slave), [0.0, 0.1, 0.35, 0.6], rtol=0.0, atol=ULPS)
    assert slave.asked == 6  # in initialisation, after its update, and at each tick


def test_a_countdown_that_is_not_known_does_not_tick_and_one_taken_back_neither() -> None:
    assert ticks_of(Clocked("countdown", [(0.0, NOT_YET_KNOWN)])) == []
    assert ticks_of(Clocked("countdown", [(0.2, CHANGED), (0.2, UNCHANGED), (0.2, NOT_YET_KNOWN)])) == [0.2]
    assert ticks_of(Clocked("countdown", [(0.2, CHANGED), (0.0, NOT_YET_KNOWN)])) == []
    assert ticks_of(Clocked("countdown", [(0.2, CHANGED), (0.2, UNCHANGED)])) == [0.2]  # it is not set again


@given(st.integers(0, 10**7), st.floats(1e-4, 10.0), st.floats(-1e4, 1e4))
def test_instants_follow_from_their_number(n: int, interval: float, begin: float) -> None:
    assert Rhythm(begin, 0.5, interval).instant(n) == begin + (0.5 + n * interval)


def test_simultaneous_clocks_are_set_by_priority() -> None:
    order: list[list[int]] = []

    class Two(Clocked):
        def more_variables(self) -> list[Any]:
            last = clock("last", 91, kind="constant", intervalDecimal=0.2, priority=7)
            first = clock("first", 92, kind="constant", intervalDecimal=0.1, priority=2)
            return [clock("unranked", 93, kind="constant", intervalDecimal=0.2), last, first]

        def setClock(self, references: Any, values: Any) -> None:
            order.append(list(references))

    ticks_of(Two("constant", intervalDecimal=1.0), 0.35, 1)
    assert order == [[92, 91, 93], [92], [92, 91, 93], [92]]


# -- what clocks may not say
# --------------------------------------------------------------------------------------------


def _nothing_of_nothing(_references: Any, counters: Any, resolutions: Any, qualifiers: Any) -> None:
    counters[0], resolutions[0], qualifiers[0] = 1, 0, CHANGED


@pytest.mark.parametrize(
    ("slave", "message"),
    [
        (Clocked("constant", intervalDecimal=0.0), "interval 0 s, expected one above 0"),
        (Clocked("fixed", [(-0.1, CHANGED)]), "interval -0.1 s, expected one above 0"),
        (Clocked("fixed", [(math.nan, CHANGED)]), "interval nan s"),
        (Clocked("changing", [(math.inf, CHANGED)]), "interval inf s, expected one 0 or more"),
        (Clocked("fixed", [(0.1, CHANGED)], shift=-1.0), "shift -1 s, expected 0 or more"),
        (Clocked("fixed", [(0.1, NOT_YET_KNOWN)]), "does not know its interval"),
        (Clocked("constant", supportsFraction=True, resolution=0, intervalCounter=1), "interval"),
    ],
)
def test_impossible_intervals_are_refused_with_component_clock_and_time(slave: Clocked, message: str) -> None:
    slave._restart()
    if slave._clock.supportsFraction:
        slave.getIntervalFraction = _nothing_of_nothing  # type: ignore[method-assign]
    with pytest.raises(RunError, match=message) as caught:
        ticks_of(slave)
    assert "Component 'c' at t = 0 s: clock 'tick'" in str(caught.value)


def test_an_interval_that_turns_bad_on_the_way_ends_the_run_with_what_was_computed() -> None:
    master = prepare(
        [component(Clocked("changing", [(0.1, CHANGED), (0.1, CHANGED), (math.nan, CHANGED)]), "c")], [], 0.07, 10
    )
    with pytest.raises(RunError, match=r"Component 'c' at t = 0.2 s: clock 'tick' \(changing\) has the interval nan"):
        master.run()
    close(master.plan)
    assert master.recorder.table()["time"][-1] == pytest.approx(0.14)


def test_a_countdown_armed_again_at_its_instant_for_ever_is_an_error(folder: Path) -> None:
    with pytest.raises(RunError, match=r"t = 0.21 s do not settle in 100 rounds.*c.alarms"):
        run(parts(c=countdown_fmu(folder)), [], 0.1, 10, starts={"c": {"repeat": True, "delay": 0.0}})


def test_a_countdown_of_zero_rings_at_the_instant_that_arms_it(folder: Path) -> None:
    seen = run(parts(c=countdown_fmu(folder)), [], 0.1, 10, starts={"c": {"delay": 0.0}})
    assert seen.jumps("c.alarms") == [0.21]


# -- connections
# --------------------------------------------------------------------------------------------------------


def test_one_clock_may_trigger_several_and_unconnected_ones_stay_silent(folder: Path) -> None:
    components = parts(
        s=triggered_fmu(folder), r=receiver_fmu(folder), other=receiver_fmu(folder), lonely=receiver_fmu(folder)
    )
    wires = [*WIRES, "s.crossing -> other.tick", "s.crossing_value -> other.tick_value"]
    seen = run(components, wires, 0.1, 10)
    np.testing.assert_array_equal(seen["r.integral"], seen["other.integral"])
    assert (seen.end("r.count"), seen.end("lonely.count")) == (5.0, 0.0)


def test_a_connected_clock_is_no_event_to_be_notified_and_frees_its_inputs(folder: Path) -> None:
    components = {c.name: c for c in parts(s=triggered_fmu(folder), r=receiver_fmu(folder))}
    try:
        assert list(components["r"].events) == ["tick"]
        with pytest.raises(CouplingError, match=r"r.tick_value belongs to an event"):
            connect([("s.crossing_value", "r.tick_value")], components)
        clocks, others = connect_clocks([tuple(w.split(" -> ")) for w in WIRES], components)  # type: ignore[misc]
        assert [str(c) for c in clocks] == [WIRES[0]]
        assert not components["r"].events
        assert [str(c) for c in connect(others, components)] == [WIRES[1]]
    finally:
        for c in components.values():
            c.free()


@pytest.mark.parametrize(
    ("wires", "message"),
    [
        (["s.crossing -> r.tick_value"], "r.tick_value is a Float64; a clock is connected to a clock"),
        (["s.ramp -> r.tick"], "s.ramp is a Float64, r.tick is a Clock"),
        (["s.crossing -> p.tick"], r"p.tick ticks at its own instants \(intervalVariability 'constant'\)"),
        (["r.tick -> r.tick"], "r.tick has causality 'input', expected output"),
        (["s.crossing -> s.crossing"], "has causality 'output', expected input"),
        (["s.crossing -> r.tick", "s.crossing -> r.tick"], "Clock r.tick has two sources"),
        (["s.crosing -> r.tick"], "did you mean 'crossing'"),
        (["mute.pulse -> r.tick"], r"mute has no Event Mode \(hasEventMode\)"),
    ],
)
def test_clocks_that_cannot_be_connected(folder: Path, wires: list[str], message: str) -> None:
    class Mute(Counter):
        def more_variables(self) -> list[Any]:
            return [clock("pulse", 77, "output")]

    components = parts(s=triggered_fmu(folder), r=receiver_fmu(folder), p=periodic_fmu(folder))
    everything = {c.name: c for c in [*components, component(Mute(), "mute")]}
    try:
        with pytest.raises(CouplingError, match=message):
            connect_clocks([tuple(w.split(" -> ")) for w in wires], everything)  # type: ignore[misc]
    finally:
        for c in components:
            c.free()


def test_descriptions_hold_the_attributes_of_clocks(folder: Path) -> None:
    path = periodic_fmu(folder)
    tick = next(v for v in read_description(path).modelVariables if v.name == "tick")
    assert (tick.intervalDecimal, tick.shiftDecimal, tick.supportsFraction, tick.priority) == (0.03, 0.01, False, None)
    loaded = load_fmu(path, "p")
    assert [c.name for c in loaded.clocks.clocks] == ["tick"]  # type: ignore[attr-defined]
    loaded.free()
    assert not any(v.type == "Clock" for v in read_description(timed_fmu(folder)).modelVariables)


# -- in a scenario
# ------------------------------------------------------------------------------------------------------


def test_a_scenario_connects_clocks_and_may_leave_events_local(folder: Path) -> None:
    def outcome(**master: Any) -> Any:
        s = (
            cosim.Scenario(stop=1.0, step=0.1)
            .add("s", fmu=str(triggered_fmu(folder)))
            .add("r", fmu=str(receiver_fmu(folder)))
        )
        s.connect(*WIRES)
        return s.master(**master).run() if master else s.run()

    together, alone = outcome(), outcome(events="local")
    assert together.failure is None
    assert together["r.integral"][-1] == pytest.approx(received_integral(1.0), abs=ULPS)
    reported = together.result.summary["master"]["events"]
    assert (reported["participants"], reported["instants"], reported["redone"]) == (["s", "r"], 5, 5)
    assert alone.failure is None
    assert alone["r.count"][-1] == 0.0
    assert alone.result.summary["master"]["events"] is None


def test_the_structure_of_a_scenario_with_clocks_can_be_shown(folder: Path) -> None:
    s = (
        cosim.Scenario(stop=1.0, step=0.1)
        .add("r", fmu=str(receiver_fmu(folder)))
        .add("s", fmu=str(triggered_fmu(folder)))
    )
    assert s.connect(*WIRES).structure().text()
