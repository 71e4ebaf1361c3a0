"""Telegrams: chance that depends on seed and number only, order of delivery, bookkeeping."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cosim.balises.telegram import Channel, Crossing, Mailbox, payload
from cosim.errors import ScenarioError
from cosim.results.result import BaliseRecord


def crossing(stamp: float, identity: str = "B1") -> Crossing:
    return Crossing(stamp, 10.0 * stamp, identity, 2.0, "rollback", 1e-11)


@given(st.lists(st.tuples(st.floats(0.0, 10.0), st.floats(0.0, 5.0)), max_size=20), st.integers(1, 30))
def test_the_mailbox_delivers_in_order_and_loses_nothing(letters: list[tuple[float, float]], count: int) -> None:
    box = Mailbox()
    taken: list[BaliseRecord] = []
    for k in range(count):
        for stamp, latency in letters[k::count]:
            box.post(BaliseRecord(stamp, stamp + latency, "B", 0.0, 0.0))
    for k in range(count):
        due = box.due(15.0 * (k + 1) / count)
        assert all(e.delivered_at <= 15.0 * (k + 1) / count for e in due)
        taken += due
    assert [e.delivered_at for e in taken] == sorted(stamp + latency for stamp, latency in letters)
    assert box.waiting == []


def test_telegrams_of_one_instant_are_delivered_in_the_order_of_their_stamps() -> None:
    box = Mailbox()
    for stamp in (3.0, 1.0, 2.0):
        box.post(BaliseRecord(stamp, 5.0, f"B{stamp:g}", 0.0, 0.0))
    assert [e.identity for e in box.due(5.0)] == ["B1", "B2", "B3"]


def test_missed_ones_are_logged_at_once_and_delivered_to_nobody() -> None:
    box = Mailbox()
    box.post(Channel(missed=frozenset({"B1"})).transmit(crossing(1.0), 0, 5.0))
    assert box.due(np.inf) == []
    assert [(e.kind, np.isnan(e.delivered_at)) for e in box.log] == [("missed", True)]


def test_a_telegram_carries_its_crossing() -> None:
    telegram = Channel(latency=0.3).transmit(crossing(1.0), 4, 13.0)
    assert (telegram.stamp, telegram.delivered_at, telegram.position, telegram.true_position) == (1.0, 1.3, 10.0, 10.0)
    assert (telegram.location_accuracy, telegram.odometer_reading, telegram.method, telegram.time_bound) == (
        2.0,
        13.0,
        "rollback",
        1e-11,
    )
    assert payload(telegram) == {
        "position": 10.0,
        "location_accuracy": 2.0,
        "odometer_reading": 13.0,
        "delivered_at": 1.3,
    }


@given(st.integers(0, 10**6), st.integers(0, 10**6))
def test_chance_comes_from_seed_and_number_only(seed: int, number: int) -> None:
    channel = Channel(latency=0.1, latency_jitter=0.5, missed_fraction=0.4, position_noise=0.3, seed=seed)
    first, again = (channel.transmit(crossing(t), number, 0.0) for t in (1.0, 2.0))
    assert first.kind == again.kind
    assert first.position - 10.0 == pytest.approx(again.position - 20.0, abs=1e-12)
    if first.kind == "true":
        assert first.delivered_at - 1.0 == pytest.approx(again.delivered_at - 2.0, abs=1e-12)
        assert 0.1 <= first.delivered_at - 1.0 <= 0.6 + 1e-12


def test_chance_has_the_stated_distribution() -> None:
    """4000 draws: the standard errors are 0.0077 of the share, 0.0023 of the latency, 1.6 % of the deviation; 4 of
    them.
    """
    channel = Channel(latency=0.1, latency_jitter=0.5, missed_fraction=0.4, position_noise=0.5, seed=1)
    reported = [channel.transmit(crossing(0.0), n, 0.0) for n in range(4000)]
    missed = np.array([e.kind == "missed" for e in reported])
    assert missed.mean() == pytest.approx(0.4, abs=0.031)
    assert np.mean([e.delivered_at for e in reported if e.kind == "true"]) == pytest.approx(0.35, abs=0.012)
    assert np.std([e.position for e in reported]) == pytest.approx(0.5 * 2.0, rel=0.05)
    assert all(Channel(missed_fraction=1.0).transmit(crossing(0.0), n, 0.0).kind == "missed" for n in range(200))
    assert all(Channel(missed_fraction=0.0).transmit(crossing(0.0), n, 0.0).kind == "true" for n in range(200))


@pytest.mark.parametrize("name", ["latency", "latency_jitter", "missed_fraction", "position_noise"])
@pytest.mark.parametrize("value", [-0.1, np.nan, np.inf])
def test_impossible_channels_are_refused(name: str, value: float) -> None:
    with pytest.raises(ScenarioError, match=f"balises.{name}"):
        Channel(**{name: value})


def test_a_fraction_is_a_probability() -> None:
    with pytest.raises(ScenarioError, match=r"is a probability, got 1.5"):
        Channel(missed_fraction=1.5)
