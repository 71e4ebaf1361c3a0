"""Stepping: the FMI 2 interface, the FMI 3 interface and the bare runtime agree bit for bit, however a step is
split.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from block_systems import SWING, Driven, H, Reference, kick, weather
from hypothesis import given, settings
from hypothesis import strategies as st

from fmu_observer import OBSERVERS
from fmu_observer.block import BlockCallError

VALUES = ["energy", "last_sample", "net_torque", "angle", "rate", "sample", "sampled_at", "marks[1]", "marks[2]"]
FMI2, FMI3, BARE = Driven(SWING, 2), Driven(SWING, 3), Reference(SWING)

# Within one step at most one event of a kind: that is what FMI 2 can tell.
OFFSETS = st.integers(0, 999).map(lambda n: n * 1e-3 * H)
PLANS = st.lists(
    st.tuples(st.one_of(st.none(), st.tuples(OFFSETS, st.floats(-2.0, 2.0))), st.one_of(st.none(), OFFSETS)),
    min_size=1,
    max_size=8,
)


@settings(max_examples=80, deadline=None)
@given(plan=PLANS, start_time=st.sampled_from([0.0, 3.0, 1234.5]))
def test_both_faces_and_the_runtime_give_equal_bits(plan: list[Any], start_time: float) -> None:
    for driven in (FMI2, FMI3):
        driven.start(start_time, angle=0.6)
    BARE.start(start_time, angle=0.6)
    for k, (kicked, marked) in enumerate(plan):
        t = FMI3.get("time")[0]
        events: list[tuple[float, str, Mapping[str, float]]] = []
        if kicked is not None:
            events.append((t + kicked[0], "kick", kick(kicked[1])))
        if marked is not None:
            events.append((t + marked, "mark", {}))
        events.sort(key=lambda e: e[0])
        for one in (FMI2, FMI3, BARE):
            one.set_all(weather(k))
        for stamp, name, payload in events:
            FMI2.event(name, stamp, payload)
            FMI3.event(name, stamp, payload)
        FMI2.step(t)
        FMI3.step(t)
        BARE.step(t, H, events)
        expected = BARE.values()
        np.testing.assert_array_equal(FMI2.get(*VALUES), expected)
        np.testing.assert_array_equal(FMI3.get(*VALUES), expected)
    reported = sum((kicked is not None) + (marked is not None) for kicked, marked in plan)
    assert FMI2.block.counters.accepted == FMI3.block.counters.accepted == reported


@pytest.mark.parametrize("name", ["differentiator_cdo", "takagi_sugeno_cdo", "multirate_cdo", "discrete_uio"])
def test_shipped_observers_are_equal_through_both_interfaces_and_bare(name: str) -> None:
    system = OBSERVERS[name]()
    driven, bare = [Driven(system, version).start() for version in (2, 3)], Reference(system).start()
    outputs = [s.name for s in system.outputs]
    for k in range(30):
        inputs = {"odometer": 12.0 + np.sin(k), "effort": 2e4 * np.cos(k)}
        inputs = {n: v for n, v in inputs.items() if n in driven[0].references}
        events = [(k * H + 0.013, "balise", {"balise_position": 12.0 * k * H})] if k % 7 == 3 else []
        for one in (*driven, bare):
            one.set_all(inputs)
        for stamp, event, payload in events:
            for one in driven:
                one.event(event, stamp, payload)
        for one in driven:
            one.step(k * H)
        bare.step(k * H, H, events)
        expected = bare.values()[: len(outputs)]
        for one in driven:
            np.testing.assert_array_equal(one.get(*outputs), expected)


@settings(max_examples=60, deadline=None)
@given(
    cuts=st.lists(st.integers(1, 59), max_size=10, unique=True),
    stamps=st.lists(st.floats(0.0, 0.46), max_size=4),
    version=st.sampled_from([2, 3]),
    start_time=st.sampled_from([0.0, 100.0]),
    internal_step=st.sampled_from([2.0**-7, 0.0077]),
)
def test_splitting_a_step_on_the_internal_grid_changes_nothing(
    cuts: list[int], stamps: list[float], version: int, start_time: float, internal_step: float
) -> None:
    whole, pieces = (FMI2, SPLIT2) if version == 2 else (FMI3, SPLIT3)
    for one in (whole, pieces):
        one.start(start_time, internal_step=internal_step)
        for i, stamp in enumerate(stamps[: 1 if version == 2 else None]):
            one.event("kick", start_time + stamp, kick(0.5 + i))
    whole.step(start_time, 60 * internal_step)
    t = start_time
    for cell in [*sorted(cuts), 60]:
        end = start_time + cell * internal_step
        pieces.step(t, end - t)
        t = end
    # 0.0077 s is no exact float: t + (end - t) misses grid points by the last place, and the grid absorbs it.
    np.testing.assert_array_equal(pieces.get(*VALUES[3:]), whole.get(*VALUES[3:]))


SPLIT2, SPLIT3 = Driven(SWING, 2), Driven(SWING, 3)


@pytest.mark.parametrize("version", [2, 3])
def test_several_events_in_one_step_happen_in_the_order_of_their_stamps(version: int) -> None:
    driven, bare = Driven(SWING, version).start(), Reference(SWING).start()
    driven.event("mark", 0.041)  # told first, happens last
    driven.event("kick", 0.0123, kick(2.0))
    driven.step(0.0)
    bare.step(0.0, H, [(0.0123, "kick", kick(2.0)), (0.041, "mark", {})])
    np.testing.assert_array_equal(driven.get(*VALUES), bare.values())


@pytest.mark.parametrize("version", [2, 3])
def test_an_event_ahead_waits_for_the_step_in_which_it_lies(version: int) -> None:
    driven, bare = Driven(SWING, version).start(), Reference(SWING).start()
    driven.event("kick", 2.5 * H, kick(2.0))
    for k in range(4):
        driven.step(k * H)
        bare.step(k * H, H, [(2.5 * H, "kick", kick(2.0))] if k == 2 else [])
        assert driven.block.counters.accepted == (k >= 2)
    np.testing.assert_array_equal(driven.get(*VALUES), bare.values())


def test_in_fmi2_an_event_without_stamp_happens_at_the_start_of_the_step() -> None:
    driven, bare = Driven(SWING, 2).start(), Reference(SWING).start()
    driven.step(0.0)
    bare.step(0.0)
    driven.event("kick", None, kick(1.0))
    driven.step(H)
    bare.step(H, H, [(H, "kick", kick(1.0))])
    np.testing.assert_array_equal(driven.get(*VALUES), bare.values())


def test_in_fmi3_the_jump_is_seen_before_the_next_step_and_clocks_tick_in_declared_order() -> None:
    driven = Driven(SWING, 3).start()
    block = driven.block
    assert block.updateDiscreteStates is not None
    block.enterEventMode()
    block.setClock(driven.vr("mark", "kick"), [True, True])
    driven.set_all(kick(2.0))
    rate = driven.get("rate")[0]
    assert block.updateDiscreteStates() == (False, False, False, True, False, 0.0)
    assert block.updateDiscreteStates() == (False, False, False, False, False, 0.0)
    kicked = 0.9 * rate + (0.5 + 0.2) * 2.0
    assert driven.get("marks[2]") == [kicked]  # the mark saw the rate after the kick
    block.enterStepMode()


def test_a_clock_set_and_unset_does_not_tick() -> None:
    driven = Driven(SWING, 3).start()
    block = driven.block
    block.enterEventMode()
    block.setClock(driven.vr("mark", "kick"), [True, True])
    block.setClock(driven.vr("kick"), [False])
    assert block.getClock(driven.vr("mark", "kick")) == [True, False]
    block.updateDiscreteStates()
    block.enterStepMode()
    assert driven.block.counters.accepted == 1
    assert driven.get("marks[1]") == [1.0]


def test_a_stamp_is_used_up_by_its_event() -> None:
    driven = Driven(SWING, 3).start()
    driven.event("mark", 0.02)
    assert driven.get("mark_time") == [-1e30]
    driven.step(0.0)
    driven.event("mark")  # no stamp: now, not at the old one
    assert driven.get("marks[1]") == [2.0]
    assert driven.block.counters.replayed == 0


# -- FMI 2: counts
# ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("counts", "accepted", "lost"),
    [
        ([1, 2, 3], 3, 0),
        ([1, 1, 1], 1, 0),
        ([2, 2], 1, 1),
        ([1, 5], 2, 3),
        ([0, 0], 0, 0),
        ([-1, 0], 1, 0),  # up from -1: an event, whatever the number
        ([-5, -3], 1, 1),
        ([3, 1, 2], 2, 2),
        ([7, 0, 0], 1, 6),
    ],
)
def test_a_raised_count_is_one_event_and_what_it_skips_is_lost(
    counts: list[int], accepted: int, lost: int, caplog: pytest.LogCaptureFixture
) -> None:
    driven = Driven(SWING, 2).start()
    with caplog.at_level(logging.WARNING):
        for k, count in enumerate(counts):
            driven.block.setInteger(driven.vr("mark_count"), [count])
            driven.step(k * H)
    assert driven.get("marks[1]") == [accepted]
    assert (driven.block.counters.accepted, driven.block.counters.lost) == (accepted, lost)
    jumps = [(a, b) for a, b in zip([0, *counts], counts, strict=False) if b not in (a, a + 1)]
    assert len(caplog.records) == len(jumps)
    for record, (before, after) in zip(caplog.records, jumps, strict=True):
        assert "event mark at t = " in record.getMessage()
        assert f"the count went from {before} to {after}" in record.getMessage()


def test_a_refused_step_does_not_use_up_a_count() -> None:
    driven = Driven(SWING, 2).start()
    driven.event("mark", 0.01)
    with pytest.raises(BlockCallError):
        driven.step(5.0)
    driven.step(0.0)
    assert driven.block.counters.accepted == 1
    assert driven.get("marks[1]") == [1.0]


def test_the_payload_is_taken_when_the_event_is_announced() -> None:
    driven, bare = Driven(SWING, 2).start(), Reference(SWING).start()
    driven.event("kick", 1.5 * H, kick(1.0))
    driven.step(0.0)
    driven.set_all(kick(-9.0))  # without an event
    driven.step(H)
    bare.step(0.0, 2 * H, [(1.5 * H, "kick", kick(1.0))])
    np.testing.assert_array_equal(driven.get("angle", "rate"), bare.runtime.x[:2])


# -- prepared calls
# -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize(
    "names",
    [
        ["energy"],
        ["net_torque", "energy"],
        ["energy", "energy"],
        ["angle", "energy", "time", "torque", "period", "mark_time"],
        [],
    ],
)
def test_a_prepared_get_is_a_get(version: int, names: list[str]) -> None:
    driven = Driven(SWING, version).start()
    values = np.full(len(names), np.nan)
    read = driven.block.prepared_get(driven.vr(*names), values)
    for k in range(4):
        driven.set_all(weather(k))
        driven.step(k * H)
        read()
        np.testing.assert_array_equal(values, driven.get(*names))
    driven.set(torque=7.0)  # also where only an input has changed
    read()
    np.testing.assert_array_equal(values, driven.get(*names))


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("names", [["torque"], ["wind[2]", "torque"], ["damping", "torque"], []])
def test_a_prepared_set_is_a_set(version: int, names: list[str]) -> None:
    prepared, plain = Driven(SWING, version).start(), Driven(SWING, version).start()
    buffer = np.zeros(len(names))
    write = prepared.block.prepared_set(prepared.vr(*names), buffer)
    for k in range(4):
        buffer[:] = [weather(k)[name] for name in names]
        write()
        plain.set_all(dict(zip(names, buffer.tolist(), strict=True)))
        np.testing.assert_array_equal(prepared.everything(), plain.everything())
        for one in (prepared, plain):
            one.step(k * H)
        np.testing.assert_array_equal(prepared.everything(), plain.everything())


def test_a_prepared_payload_is_written_where_it_may_be() -> None:
    driven = Driven(SWING, 3).start()
    write = driven.block.prepared_set(driven.vr("kick_impulse"), np.array([3.0]))
    with pytest.raises(BlockCallError, match=r"kick_impulse .* only in: instantiated, initialization, event"):
        write()
    driven.block.enterEventMode()
    write()
    assert driven.get("kick_impulse") == [3.0]


@pytest.mark.parametrize("call", ["prepared_get", "prepared_set"])
def test_a_faulty_preparation_is_refused_at_once(call: str) -> None:
    block = Driven(SWING, 3).block
    with pytest.raises(
        BlockCallError, match=rf"{call}: swing .* no variable with value reference 999; the last one is \d+"
    ):
        getattr(block, call)([999], np.zeros(1))
    with pytest.raises(BlockCallError, match=rf"{call}: .*shape \(2,\), expected \(1,\)"):
        getattr(block, call)([1], np.zeros(2))
