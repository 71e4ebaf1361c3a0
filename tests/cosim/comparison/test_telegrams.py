"""Telegrams compared as events."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_results import STRICT, made

from cosim.comparison.event_comparison import compare_telegrams
from cosim.comparison.verdict import EventComparison
from cosim.results.result import BaliseRecord

RECORDS = [
    BaliseRecord(
        stamp=1.0 + k,
        delivered_at=1.1 + k,
        identity=f"b{k % 3}",
        position=100.0 * k,
        true_position=100.0 * k,
        odometer_reading=10.0,
        outcomes={"observer": "accepted", "other": "late"},
    )
    for k in range(9)
]
RUN: dict[str, object] = {"components": []}


def verdict(reference: list[BaliseRecord], result: list[BaliseRecord]) -> EventComparison:
    time = [0.0, 10.0]
    return compare_telegrams(
        made(time, y=time, events=reference, summary=RUN), made(time, y=time, events=result, summary=RUN), STRICT, 10.0
    )


def changed(which: int, **changes: object) -> list[BaliseRecord]:
    return [replace(r, **changes) if k == which else r for k, r in enumerate(RECORDS)]  # type: ignore[arg-type]


@given(st.permutations(RECORDS))
def test_order_in_the_list_is_irrelevant(shuffled: list[BaliseRecord]) -> None:
    reported = verdict(RECORDS, shuffled)
    assert (reported.matched, reported.differences, reported.max_shift) == (9, [], 0.0)


@given(st.sets(st.integers(0, 8), max_size=8))
def test_missing_and_extra_ones_are_those_left_out(gone: set[int]) -> None:
    """Although names repeat: three crossings of each of three balises."""
    rest = [record for k, record in enumerate(RECORDS) if k not in gone]
    there, back = verdict(RECORDS, rest), verdict(rest, RECORDS)
    assert there.matched == back.matched == 9 - len(gone)
    expected = [RECORDS[k] for k in sorted(gone)]
    assert [(d.kind, d.reference) for d in there.differences] == [("missing", r) for r in expected]
    assert [(d.kind, d.result) for d in back.differences] == [("extra", r) for r in expected]


def test_a_late_stamp_is_a_difference_in_time() -> None:
    reported = verdict(RECORDS, changed(4, stamp=5.01, delivered_at=5.11))
    (found,) = reported.differences
    assert found.kind == "time"
    assert "passed 0.01 s late" in found.text
    assert "delivered 0.01 s late" in found.text
    assert reported.max_shift == pytest.approx(0.01)
    assert not verdict(RECORDS, changed(4, stamp=5.0 + 5e-7)).differences


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"position": 400.5}, "position 400.5 m instead of 400 m"),
        ({"odometer_reading": float("nan")}, "odometer_reading nan m/s instead of 10 m/s"),
        ({"identity": "b9"}, "identity 'b9' instead of 'b1'"),
        ({"kind": "missed"}, "kind 'missed' instead of 'true'"),
        ({"outcomes": {"observer": "rejected"}}, "outcome at observer 'rejected' instead of 'accepted'"),
    ],
)
def test_content_is_compared(change: dict[str, object], text: str) -> None:
    reported = verdict(RECORDS, changed(4, **change))
    (found,) = reported.differences
    assert found.kind == "payload"
    assert text in found.text
    assert reported.matched == 9


def test_content_within_tolerance_and_receivers_of_one_side_pass() -> None:
    assert not verdict(RECORDS, changed(4, position=400.0005)).differences
    assert not verdict(RECORDS, changed(4, outcomes={"observer": "accepted", "new": "late"})).differences


def test_never_delivered_is_reported() -> None:
    (found,) = verdict(RECORDS, changed(4, delivered_at=float("nan"))).differences
    assert "delivered never" in found.text


def test_a_plain_table_keeps_no_telegrams() -> None:
    time = np.array([0.0, 10.0])
    table, run = made(time, y=time), made(time, y=time, events=RECORDS, summary=RUN)
    assert not compare_telegrams(table, run, STRICT, 10.0).compared
    assert not compare_telegrams(run, table, STRICT, 10.0).compared
    empty = made(time, y=time, summary={**RUN, "events_recorded": False})
    assert not compare_telegrams(run, empty, STRICT, 10.0).compared
    none = made(time, y=time, summary=RUN)
    assert len(compare_telegrams(run, none, STRICT, 10.0).differences) == 9
