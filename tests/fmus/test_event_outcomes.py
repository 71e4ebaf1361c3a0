"""Counts of what became of events: FMU and block, all ways of telling, all policies, against what the stamps alone
say.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from exchange_importer import Exchange, Importer, Notified
from fmpy.fmi1 import FMICallException
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fmu_observer.block import make_block
from fmu_observer.event_protocol import LATE_POLICIES, OUTCOME_TEXTS, OUTCOME_VARIABLES
from plant_models.hybrid import HybridSystem

pytestmark = pytest.mark.compiler

H, STEPS, HORIZON = 0.1, 12, 0.36
NAMES = ("balise", "telegram")
FIXTURES_LIVE_ON = [HealthCheck.function_scoped_fixture]  # every example resets its components
KINDS = [(2, False), (3, False), (3, True)]
"""Version of FMI, and whether it is told of events by counts there."""


def outcomes(one: Any) -> dict[str, int]:
    """The counts, by the handle of a component."""
    return dict(zip(OUTCOME_TEXTS, one.get(*OUTCOME_VARIABLES).astype(int).tolist(), strict=True))


def counted(**some: int) -> dict[str, int]:
    """All counts, those that are not named zero."""
    return dict.fromkeys(OUTCOME_TEXTS, 0) | some


@pytest.fixture
def trackers(component: Callable[..., Any], reference: Callable[[str], Any]) -> list[Any]:
    """An FMU and a block of each kind."""
    made = []
    for version, counts in KINDS:
        sealed, borrowed = (component("tracker", version, counts=counts) for _ in range(2))
        borrowed.slave.freeInstance()
        borrowed.slave = make_block(reference("tracker").system, version, announcement="counts" if counts else None)  # type: ignore[arg-type]
        borrowed.instantiate()
        made += [sealed, borrowed]
    return made


@dataclass(frozen=True)
class Announced:
    """One event: notified before step `notified`, and how far its stamp lies ahead (behind where negative) [s]."""

    reported: int
    name: str
    ahead: float


ANNOUNCED = st.builds(
    Announced, st.integers(0, STEPS - 1), st.sampled_from(NAMES), st.integers(-6, 6).map(lambda n: 0.07 * n)
)  # a stamp never lies on a communication point, nor at the edge of the horizon
HAPPENINGS = st.lists(ANNOUNCED, max_size=8, unique_by=lambda a: (a.reported, a.name))


def expected(happenings: list[Announced], policy: str, end: float) -> dict[str, int]:
    """What the stamps alone say."""
    said = counted()
    for happening in happenings:
        stamp = happening.reported * H + happening.ahead
        if happening.ahead >= 0.0:
            said["accepted"] += stamp <= end + 1e-9
        elif policy == "late":
            said["late"] += 1
            said["accepted"] += 1
        elif policy == "replay" and stamp >= 0.0 and -happening.ahead <= HORIZON:
            said["replayed"] += 1
            said["accepted"] += 1
        else:
            said["rejected"] += 1
    return said


def drive(one: Any, happenings: list[Announced], first: int, last: int) -> None:
    """Steps `first` up to `last`."""
    for k in range(first, last):
        one.set(odometer=10.0 + 0.1 * k)
        for happening in happenings:
            if happening.reported == k:
                payload = {"balise_position": 1.0 * k} if happening.name == "balise" else {"telegram_speed": 9.0}
                one.event(happening.name, k * H + happening.ahead, **payload)
        one.step(k * H, H)


def begin(one: Any, policy: str) -> None:
    one.slave.reset()
    one.set_policy(LATE_POLICIES.index(policy) + 1)  # type: ignore[arg-type]
    one.initialize(replay_horizon=HORIZON)


@settings(max_examples=60, deadline=None, suppress_health_check=FIXTURES_LIVE_ON)
@given(happenings=HAPPENINGS, policy=st.sampled_from(LATE_POLICIES), cut=st.integers(0, STEPS))
def test_any_telegrams(happenings: list[Announced], policy: str, cut: int, trackers: list[Any]) -> None:
    """On time, ahead and late, in any order; then from a state that was saved on the way, once as it is and once as
    bytes.
    """
    for one in trackers:
        begin(one, policy)
        assert outcomes(one) == counted()
        drive(one, happenings, 0, cut)
        half, saved = outcomes(one), one.save()
        content = one.serialize(saved)
        drive(one, happenings, cut, STEPS)
        assert outcomes(one) == expected(happenings, policy, STEPS * H)
        whole = one.values()
        for state in (saved, one.deserialize(content)):
            one.restore(state)
            assert outcomes(one) == half
            drive(one, happenings, cut, STEPS)
            assert outcomes(one) == expected(happenings, policy, STEPS * H)
            np.testing.assert_array_equal(one.values(), whole)
            one.free(state)


def test_a_step_that_is_undone_counts_nothing(trackers: list[Any]) -> None:
    for one in (one for one in trackers if "balise_count" in one.by_name):
        one.initialize()
        one.set(odometer=np.nan)
        one.event("balise", 0.05, balise_position=3.0)
        with pytest.raises(FMICallException):
            one.step(0.0, H)
        assert outcomes(one) == counted()
        one.set(odometer=10.0)
        one.step(0.0, H)
        assert outcomes(one) == counted(accepted=1)


def test_events_that_a_count_leaves_out_are_lost(trackers: list[Any]) -> None:
    for one in (one for one in trackers if "balise_count" in one.by_name):
        one.initialize()
        one.raise_count("balise", 4)
        one.step(0.0, H)
        assert outcomes(one) == counted(accepted=1, lost=3)


def test_a_full_queue_loses_events(trackers: list[Any]) -> None:
    for one in trackers:
        one.initialize()
        for k in range(66):
            one.event("balise", 100.0 + k, balise_position=3.0)
            one.step(k * H, H)
        assert outcomes(one) == counted(lost=2)


def test_the_counts_cannot_be_set(trackers: list[Any]) -> None:
    for one in trackers:
        put = one.slave.setInteger if one.version == 2 else one.slave.setInt32
        with pytest.raises(FMICallException):
            put(one.references(["events.late"]), [1])
        with pytest.raises(FMICallException):
            one.set_all({"events.late": 1.0})
        assert outcomes(one) == counted()


@pytest.mark.parametrize("policy", LATE_POLICIES)
def test_model_exchange(version: int, policy: str, exchange: Callable[..., Exchange]) -> None:
    """One event on time, one that waits, one told late, which nobody can replay there."""
    one = exchange("tracker", version)
    put = one.model.setInteger if version == 2 else one.model.setInt64
    put([one.by_name["late_policy"].valueReference], [LATE_POLICIES.index(policy) + 1])  # type: ignore[arg-type]
    importer = Importer(one, one.initialize())
    get = one.model.getInteger if version == 2 else one.model.getInt32
    references = [one.by_name[name].valueReference for name in OUTCOME_VARIABLES]

    def now() -> dict[str, int]:
        return dict(zip(OUTCOME_TEXTS, get(references), strict=True))

    importer.happen([Notified(0.0, "balise", {"balise_position": 1.0})])
    assert now() == counted(accepted=1)
    importer.happen([Notified(0.0, "balise", {"balise_position": 2.0}, stamp=0.12)])
    assert now() == counted(accepted=1)
    importer.advance(0.27)
    assert now() == counted(accepted=2)
    importer.happen([Notified(0.27, "balise", {"balise_position": 50.0}, stamp=0.1)])
    last = counted(accepted=3, late=1) if policy == "late" else counted(accepted=2, rejected=1)
    assert now() == last
    content = one.save()
    importer.happen([Notified(0.27, "telegram", {"telegram_speed": 1.0})])
    assert now() == last | {"accepted": last["accepted"] + 1}
    one.restore(content)
    assert now() == last


def test_a_model_without_notified_events_has_no_counts(version: int, component: Callable[..., Any]) -> None:
    assert not OUTCOME_VARIABLES.keys() & component("oscillator", version).by_name.keys()


def test_no_signal_can_take_the_name_of_a_count(reference: Callable[[str], Any]) -> None:
    system: HybridSystem = reference("tracker").system
    names = {s.name for s in (*system.states, *system.input_signals, *system.outputs, *system.parameter_signals)}
    assert all(not name.isidentifier() for name in OUTCOME_VARIABLES)  # and a signal's name is one
    assert all(name.isidentifier() for name in names)
