"""Late events: with `replay`, what comes out is bit for bit what had come out if the event had been told in time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from block_systems import SWING, Driven, H, kick, weather
from hypothesis import given, settings
from hypothesis import strategies as st

from fmu_observer import OBSERVERS
from fmu_observer.block import BlockError

STEPS = 24


@dataclass(frozen=True)
class Happening:
    """An event, the number of the step in which it falls, and by how many steps it is told late (0: in time)."""

    stamp: float
    name: str
    payload: Mapping[str, float]
    delay: int

    @property
    def step(self) -> int:
        # equal but for rounding
        return int(np.searchsorted(np.arange(STEPS) * H, self.stamp + 1e-15, side="right")) - 1

    @property
    def reported(self) -> int:
        """Number of the communication point at which it is told; a nanosecond later is not late but now, so one later
        then.
        """
        reported = min(STEPS, self.step + self.delay)
        if self.delay > 0 and reported * H - self.stamp < 1.1e-9:
            return reported + 1 if reported < STEPS else self.step
        return reported


TIMES = st.one_of(
    st.integers(0, round(STEPS * H * 1e10) - 1).map(lambda n: n * 1e-10),
    st.integers(0, STEPS - 1).map(lambda k: k * H),  # on a communication point
    st.builds(
        lambda k, d: max(0.0, k * H + d),
        st.integers(1, STEPS - 1),
        st.sampled_from([-2e-9, -5e-10, -1e-14, 5e-10, 2e-9]),
    ),
    st.integers(0, STEPS * 5 - 1).map(lambda k: k * 0.01),  # on the internal grid
    st.integers(0, 16).map(lambda k: 0.013 + k * 0.07),  # on a sampling instant
)
EVENTS = st.one_of(
    st.floats(-3.0, 3.0).map(lambda i: ("kick", kick(i))),
    st.just(("mark", {})),
)
HAPPENINGS = st.builds(lambda t, e, d: Happening(t, e[0], e[1], d), TIMES, EVENTS, st.integers(0, STEPS))


def _distinguishable(happenings: list[Happening]) -> bool:
    """Events less than a nanosecond apart are one instant for a block: then the order of telling decides."""
    return bool((np.diff(sorted(h.stamp for h in happenings)) > 3e-9).all())


def _run(driven: Driven, happenings: list[Happening], notified_at: Any, in_time: bool) -> np.ndarray:
    """Step through and tell each event at its own step's start, or late, in the order of the list."""
    driven.start()
    for k in range(STEPS + 1):
        reported = [h for h in happenings if (h.step if in_time else h.reported) == k]
        if k < STEPS:
            driven.set_all(notified_at(k))
        for happening in reported:
            driven.event(happening.name, happening.stamp, happening.payload)
        if k < STEPS:
            driven.step(k * H)
    return driven.what_matters()


ON_TIME, LATE = Driven(SWING, 3), Driven(SWING, 3)


@settings(max_examples=150, deadline=None)
@given(st.lists(HAPPENINGS, min_size=1, max_size=6).filter(_distinguishable))
def test_any_events_notified_late_in_any_order_give_what_notifying_in_time_gives(happenings: list[Happening]) -> None:
    expected = _run(ON_TIME, happenings, weather, in_time=True)
    found = _run(LATE, happenings, weather, in_time=False)
    np.testing.assert_array_equal(found, expected)
    assert LATE.block.counters.replayed == len([h for h in happenings if h.reported > h.step])
    assert LATE.block.counters.accepted == ON_TIME.block.counters.accepted == len(happenings)
    assert ON_TIME.block.counters.replayed == 0


def _train_inputs(names: set[str]) -> Any:
    def inputs(k: int) -> dict[str, float]:
        values = {"effort": 3e4 * np.sin(0.3 * k), "odometer": 12.0 + np.sin(0.5 * k)}
        return {name: value for name, value in values.items() if name in names}

    return inputs


@pytest.mark.parametrize("name", ["differentiator_cdo", "takagi_sugeno_cdo", "multirate_cdo", "discrete_uio"])
def test_shipped_observers_obey_the_law_of_replay(name: str) -> None:
    system = OBSERVERS[name]()
    on_time, late = Driven(system, 3), Driven(system, 3)
    rng = np.random.default_rng(8)
    stamps = np.sort(rng.uniform(0.0, STEPS * H, 8))
    happenings = [Happening(float(s), "balise", {"balise_position": 12.0 * s}, int(rng.integers(0, 9))) for s in stamps]
    rng.shuffle(happenings)  # type: ignore[arg-type]
    inputs = _train_inputs({s.name for s in system.inputs})
    in_time = sorted(happenings, key=lambda h: h.stamp)
    np.testing.assert_array_equal(_run(late, happenings, inputs, False), _run(on_time, in_time, inputs, True))
    without = _run(on_time, [], inputs, True)
    assert np.abs(late.what_matters() - without).max() > 1e-3  # the events mattered
    assert late.block.counters.replayed >= 3


def test_fmi2_replays_as_fmi3_does() -> None:
    driven = [Driven(SWING, version).start() for version in (2, 3)]
    for one in driven:
        for k in range(10):
            one.set_all(weather(k))
            if k == 7:
                one.event("kick", 0.1234, kick(2.0))
            one.step(k * H)
    shared = [v.name for v in driven[0].block.model_description.modelVariables if v.type == "Real"]
    np.testing.assert_array_equal(driven[0].get(*shared), driven[1].get(*shared))
    assert driven[0].block.counters == driven[1].block.counters
    assert driven[0].block.counters.replayed == 1


def test_tunable_parameters_are_lived_again_as_they_were_and_keep_their_present_value() -> None:
    late, on_time = Driven(SWING, 3).start(), Driven(SWING, 3).start()
    on_time.event("kick", 0.02, kick(1.0))
    for k, damping in enumerate([0.1, 0.9, 0.4]):
        for one in (late, on_time):
            one.set(damping=damping)
            one.step(k * H)
    late.set(damping=0.7)
    on_time.set(damping=0.7)
    late.event("kick", 0.02, kick(1.0))
    np.testing.assert_array_equal(late.everything(), on_time.everything())
    assert late.get("damping") == [0.7]


def test_present_inputs_survive_a_replay() -> None:
    driven = Driven(SWING, 3).start()
    driven.step(0.0)
    driven.set(torque=4.5)
    driven.event("mark", 0.01)
    assert driven.get("torque") == [4.5]


@pytest.mark.parametrize("policy", ["replay", "reject", "late"])
def test_each_policy_does_what_it_says(policy: Any) -> None:
    driven, plain, now = Driven(SWING, 3, late_policy=policy), Driven(SWING, 3), Driven(SWING, 3)
    for one in (driven, plain, now):
        one.start()
        for k in range(6):
            one.step(k * H)
    driven.event("kick", 0.1, kick(2.0))
    now.event("kick", None, kick(2.0))
    counters = vars(driven.block.counters)
    assert {name: count for name, count in counters.items() if count} == {
        "replay": {"accepted": 1, "replayed": 1},
        "reject": {"rejected": 1},
        "late": {"accepted": 1, "late": 1},
    }[policy]
    equal_to_plain = bool((driven.get("angle", "rate", "sample") == plain.get("angle", "rate", "sample")).all())
    equal_to_now = bool((driven.get("angle", "rate", "sample") == now.get("angle", "rate", "sample")).all())
    assert (equal_to_plain, equal_to_now) == {"replay": (False, False), "reject": (True, False), "late": (False, True)}[
        policy
    ]


@pytest.mark.parametrize("horizon", [0.0, 0.2, 5.0])
def test_beyond_the_horizon_an_event_is_rejected_and_counted(horizon: float) -> None:
    driven = Driven(SWING, 3, replay_horizon=horizon).start()
    steps = 400  # more records than the journal keeps without pruning
    for k in range(steps):
        driven.step(k * H)
    before = driven.everything()
    end = steps * H
    driven.event("mark", end - horizon - 1e-6)
    driven.event("mark", -0.5)  # before time began to run
    np.testing.assert_array_equal(driven.everything(), before)
    assert (driven.block.counters.rejected, driven.block.counters.accepted) == (2, 0)
    driven.event("mark", end - 0.999 * horizon)
    assert driven.block.counters.accepted == 1
    assert driven.get("marks[1]") == [1.0]


def test_the_past_is_bounded_and_always_reaches_as_far_as_the_horizon() -> None:
    driven = Driven(SWING, 3, replay_horizon=1.0).start()
    for k in range(900):
        driven.step(k * H)
        records = driven.block.getFMUState().records
        assert len(records) <= 257
        assert records[0].t <= max(0.0, (k + 1) * H - 1.0)


def test_an_event_notified_twice_happens_twice_late_or_not() -> None:
    late, on_time = Driven(SWING, 3).start(), Driven(SWING, 3).start()
    for _ in range(2):
        on_time.event("kick", 0.03, kick(1.5))
    for one in (late, on_time):
        one.step(0.0)
    for _ in range(2):
        late.event("kick", 0.03, kick(1.5))
    np.testing.assert_array_equal(late.everything(), on_time.everything())


def test_of_equal_stamps_the_one_notified_first_comes_first_late_or_not() -> None:
    runs = []
    for names in (("kick", "mark"), ("mark", "kick")):
        late, on_time = Driven(SWING, 3).start(), Driven(SWING, 3).start()
        for name in names:
            on_time.event(name, 0.03, kick(1.0) if name == "kick" else {})
        for one in (late, on_time):
            one.step(0.0)
        for name in names:
            late.event(name, 0.03, kick(1.0) if name == "kick" else {})
        np.testing.assert_array_equal(late.everything(), on_time.everything())
        runs.append(late.get("rate")[0])
    assert runs[0] != runs[1]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"late_policy": "ignore"}, "late_policy 'ignore' is unknown; use one of replay, reject, late"),
        ({"replay_horizon": -1.0}, r"replay_horizon = -1\.0 s"),
        ({"replay_horizon": float("nan")}, "replay_horizon = nan s"),
    ],
)
def test_a_faulty_policy_is_refused(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(BlockError, match=message):
        Driven(SWING, 3, **arguments)
