"""Late events inside the FMU: FMI 2, FMI 3 with clocks, FMI 3 with counts and the Python block do the same, bit for
bit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from exchange_importer import INSTANCE
from fmpy.fmi1 import FMICallException
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fmu_observer.block import make_block
from fmu_observer.event_protocol import JOURNAL_CAPACITY

pytestmark = pytest.mark.compiler

H = 0.05
STEPS = 24
FIXTURES_LIVE_ON = [HealthCheck.function_scoped_fixture]  # every example resets its components

KINDS = {"fmi2": (2, False), "fmi3 clocks": (3, False), "fmi3 counts": (3, True)}
"""Version of FMI, and whether it is told of events by counts there."""


@dataclass
class Notified:
    """An event, the step in which it falls, and the step before which it is told."""

    stamp: float
    name: str
    payload: Mapping[str, float]
    step: int
    reported: int


def _kick(impulse: float) -> dict[str, float]:
    return {"kick_impulse": impulse, "kick_share[1]": 0.5 + 0.1 * impulse, "kick_share[2]": -0.1 * impulse}


def _reported(stamp: float, event: tuple[str, Mapping[str, float]], delay: int) -> Notified:
    step = int(np.searchsorted(np.arange(STEPS) * H, stamp + 1e-15, side="right")) - 1  # equal but for rounding
    reported = min(STEPS, step + delay)
    if delay > 0 and reported * H - stamp < 1.1e-9:  # a nanosecond later is not late but now, so one step later then
        reported = reported + 1 if reported < STEPS else step
    return Notified(stamp, event[0], event[1], step, reported)


STAMPS = st.one_of(
    st.integers(0, round(STEPS * H * 1e10) - 1).map(lambda n: n * 1e-10),
    st.integers(0, STEPS - 1).map(lambda k: k * H),  # on a communication point
    st.integers(0, STEPS * 5 - 1).map(lambda k: k * 0.01),  # on the internal grid
    st.integers(0, 16).map(lambda k: 0.013 + k * 0.07),  # on a sampling instant
)
EVENTS = st.one_of(st.floats(-3.0, 3.0).map(lambda i: ("kick", _kick(i))), st.just(("mark", {})))
HAPPENINGS = st.lists(st.builds(_reported, STAMPS, EVENTS, st.integers(0, STEPS)), min_size=1, max_size=6)


def _tellable(happenings: list[Notified]) -> bool:
    """Not less than a nanosecond apart, which is one instant; a count tells of one event of each name before a step."""
    apart = bool((np.diff(sorted(h.stamp for h in happenings)) > 3e-9).all())
    return apart and len({(h.name, h.reported) for h in happenings}) == len(happenings)


def _weather(k: int) -> dict[str, float]:
    """Inputs proper and tunable parameters before step k."""
    return {
        "force": float(np.sin(0.7 * k)),
        "wind[1]": 0.3 * float(np.cos(1.3 * k)),
        "wind[2]": 0.01 * k,
        "drag": 0.2 + 0.1 * float(np.sin(0.4 * k)),
        "lift[1]": 0.5 + 0.02 * (k // 5),
    }


def _run(one: Any, happenings: list[Notified], in_time: bool) -> np.ndarray:
    one.slave.reset()
    one.initialize()
    for k in range(STEPS + 1):
        one.set_all(_weather(k))
        for happening in happenings:
            if k == (happening.step if in_time else happening.reported):
                one.event(happening.name, happening.stamp, **happening.payload)
        one.step(k * H, H)
    return np.append(one.values(), one.get("time"))


def _as_block(made: Any, system: Any, **arguments: Any) -> Any:
    """A second component, of which only the handle is used: it drives the block."""
    made.slave.freeInstance()
    made.slave = make_block(system, made.version, instance_name=INSTANCE, **arguments)
    made.instantiate()
    return made


@settings(max_examples=60, deadline=None, suppress_health_check=FIXTURES_LIVE_ON)
@given(happenings=HAPPENINGS.filter(_tellable))
def test_events_notified_late_in_any_order_have_the_effect_of_events_notified_in_time(
    happenings: list[Notified], hoppers: dict[str, Any]
) -> None:
    in_time = _run(hoppers["block"], sorted(happenings, key=lambda h: h.stamp), in_time=True)
    for name, one in hoppers.items():
        np.testing.assert_array_equal(_run(one, happenings, in_time=False), in_time, err_msg=name)
        assert not one.log


@pytest.fixture
def hoppers(component: Callable[..., Any], reference: Callable[[str], Any]) -> dict[str, Any]:
    """The block and the three kinds of FMU."""
    system = reference("hopper").system
    made = {name: component(system, version, counts=counts) for name, (version, counts) in KINDS.items()}
    return {"block": _as_block(component(system, 3), system)} | made


@pytest.fixture(params=list(KINDS))
def tracker(request: pytest.FixtureRequest, component: Callable[..., Any]) -> Any:
    """A tracker of each kind, instantiated."""
    version, counts = KINDS[request.param]
    return component("tracker", version, counts=counts)


@pytest.fixture
def twin(tracker: Any, component: Callable[..., Any], reference: Callable[[str], Any]) -> Any:
    """The block of the same kind."""
    counts = "balise_count" in tracker.by_name
    made = component("tracker", tracker.version, counts=counts)
    return _as_block(made, reference("tracker").system, announcement="counts" if counts else "clocks")


def _late_story(one: Any, steps: int = 12, stamp: float = 0.1234) -> np.ndarray:
    one.initialize()
    rows = []
    for k in range(steps):
        if k == steps - 3:
            one.event("balise", stamp, balise_position=3.0)
        one.step(k * H, H)
        rows.append(one.values())
    return np.array(rows)


@pytest.mark.parametrize("policy", [1, 2, 3])
def test_each_policy_is_that_of_the_block(policy: int, tracker: Any, twin: Any) -> None:
    for one in (tracker, twin):
        one.set_policy(policy)
    np.testing.assert_array_equal(_late_story(tracker), _late_story(twin))
    counters = vars(twin.slave.counters)
    expected = {1: {"accepted": 1, "replayed": 1}, 2: {"rejected": 1}, 3: {"accepted": 1, "late": 1}}
    assert {name: count for name, count in counters.items() if count} == expected[policy]
    assert [line for line in tracker.log if "late_policy is reject" in line] if policy == 2 else not tracker.log


def test_the_policy_is_fixed_once_time_runs_and_has_three_values(tracker: Any, twin: Any) -> None:
    for one in (tracker, twin):
        for number in (0, 4, -1):
            with pytest.raises(FMICallException):
                one.set_policy(number)
        one.initialize()
        with pytest.raises(FMICallException):
            one.set_policy(2)
        with pytest.raises(FMICallException):
            one.set(replay_horizon=1.0)
        assert one.get("late_policy", "replay_horizon").tolist() == [1.0, 10.0]
    assert any("late_policy = 4 is unknown; use 1 (replay), 2 (reject) or 3 (late)" in line for line in tracker.log)


@pytest.mark.parametrize("horizon", [-1.0, float("nan"), float("inf")])
def test_a_horizon_that_is_no_time_is_refused(horizon: float, tracker: Any, twin: Any) -> None:
    for one in (tracker, twin):
        with pytest.raises(FMICallException):
            one.initialize(replay_horizon=horizon)
    assert "parameter replay_horizon" in tracker.log[-1]


@pytest.mark.parametrize("horizon", [0.0, 0.2, 5.0])
def test_beyond_the_horizon_an_event_is_rejected_with_the_reason(horizon: float, tracker: Any, twin: Any) -> None:
    for one in (tracker, twin):
        one.initialize(replay_horizon=horizon)
        t = 0.0
        for k in range(120):
            t = k * H
            one.step(t, H)
        end = 120 * H
        one.event("balise", end - horizon - 1e-6, balise_position=1.0)  # just out of reach
        one.step(end, H)
        before = one.get("innovation")[0]
        assert before == 0.0
        one.event("balise", end + H - 0.999 * horizon, balise_position=1.0)
        one.step(end + H, H)
        assert one.get("innovation")[0] != 0.0
    np.testing.assert_array_equal(tracker.values(), twin.values())
    assert len(tracker.log) == twin.slave.counters.rejected == 1
    assert "it lies further back than replay_horizon" in tracker.log[0]


def test_before_time_ran_there_is_nothing_to_replay(tracker: Any, twin: Any) -> None:
    np.testing.assert_array_equal(_late_story(tracker, stamp=-0.5), _late_story(twin, stamp=-0.5))
    assert len(tracker.log) == twin.slave.counters.rejected == 1
    assert "before the first of the steps that are remembered" in tracker.log[0]


@contextmanager
def _remembered(one: Any, steps: int) -> Iterator[float]:
    """A component after so many steps; every one of them is a record. Yields its time."""
    h = 1.0 / 1024.0  # exact sums
    one.initialize(replay_horizon=1e3)
    for k in range(steps):
        one.step(k * h, h)
    yield h


def test_as_many_steps_are_remembered_as_by_the_block(tracker: Any, twin: Any) -> None:
    """The oldest record that counts is within reach, the one before it is not, in both."""
    steps, extra = JOURNAL_CAPACITY + 100, 100
    for one in (tracker, twin):
        with _remembered(one, steps) as h:
            one.event("balise", (extra - 0.5) * h, balise_position=9.0)  # in the last record that was dropped
            one.step(steps * h, h)
            assert one.get("innovation") == [0.0]
            one.event("balise", (extra + 1.5) * h, balise_position=9.0)  # in the oldest one, one step later
            one.step((steps + 1) * h, h)
    np.testing.assert_array_equal(tracker.values(), twin.values())
    assert tracker.get("innovation")[0] != 0.0
    assert (twin.slave.counters.rejected, twin.slave.counters.replayed) == (1, 1)
    assert len(tracker.log) == 1
    assert "before the first of the steps that are remembered" in tracker.log[0]


def test_what_was_set_as_payload_stays_whatever_happens_inside(tracker: Any, twin: Any) -> None:
    """An importer may set an input once and expect to find it; events of the past bring their own payload."""
    for one in (tracker, twin):
        one.initialize()
        one.event("telegram", 0.49, telegram_speed=8.0, telegram_weight=0.25)  # ahead
        one.event("balise", 0.02, balise_position=5.0)
        for k in range(8):
            one.step(k * H, H)
        one.event("telegram", 0.13, telegram_speed=12.0, telegram_weight=0.75)
        for k in range(8, 12):
            one.step(k * H, H)
        np.testing.assert_array_equal(
            one.get("balise_position", "telegram_speed", "telegram_weight"), [5.0, 12.0, 0.75]
        )
    np.testing.assert_array_equal(tracker.values(), twin.values())


def test_saved_states_remember_the_past(tracker: Any, component: Callable[..., Any]) -> None:
    """Saved, restored, and as bytes in another instance: an event of before the save has the same effect."""
    counts = "balise_count" in tracker.by_name
    other = component("tracker", tracker.version, counts=counts)
    tracker.initialize(replay_horizon=2.0)
    other.initialize()
    for k in range(100):
        tracker.set(odometer=10.0 + 0.1 * k)
        tracker.step(k * H, H)
    saved = tracker.save()
    content = tracker.serialize(saved)

    def go_on(one: Any) -> np.ndarray:
        one.event("balise", 99.5 * H - 1.7, balise_position=60.0)
        rows = []
        for k in range(100, 110):
            one.step(k * H, H)
            rows.append(one.values())
        return np.array(rows)

    first = go_on(tracker)
    tracker.restore(saved)
    np.testing.assert_array_equal(go_on(tracker), first)
    other.restore(other.deserialize(content))
    np.testing.assert_array_equal(go_on(other), first)
    assert not tracker.log
    assert not other.log
    assert first[0, 1] != 0.0


def test_a_saved_state_is_as_large_as_its_past(tracker: Any) -> None:
    tracker.initialize(replay_horizon=1.0)
    sizes = []
    for k in range(300):
        if k in (0, 1, 100, 299):
            sizes.append(len(tracker.serialize(tracker.save())))
        tracker.step(k * H, H)
    empty, one, full, later = sizes
    assert empty < one < full
    assert abs(later - full) <= 32 * 8 * 8  # what lies before the horizon is not saved, but for the rest of a block


def test_damaged_pasts_are_refused(tracker: Any) -> None:
    tracker.initialize()
    for k in range(40):
        tracker.step(k * H, H)
    content = np.frombuffer(tracker.serialize(tracker.save()), dtype=np.int64).copy()
    first, end = 7, 8  # position of the range of records in the head
    assert (content[first], content[end]) == (0, 40)
    for place, value in ((first, -1), (first, 32), (end, -1), (end, 41), (end, 2**62), (first, 2**63 - 1)):
        damaged = content.copy()
        damaged[place] = value
        with pytest.raises(FMICallException):
            tracker.deserialize(damaged.tobytes())
    kinds = np.flatnonzero(content.view(np.float64) == -1.0)
    assert len(kinds) >= 40  # each record says that it is an advance
    for value in (7.0, 0.5, -3.0, np.nan):
        damaged = content.copy()
        damaged.view(np.float64)[kinds[-1]] = value
        with pytest.raises(FMICallException):
            tracker.deserialize(damaged.tobytes())
