"""The order of observers: laws over any shares and errors."""

from __future__ import annotations

from math import inf, isfinite
from types import SimpleNamespace
from typing import Any, cast

from hypothesis import example, given
from hypothesis import strategies as st

from cosim.choice.allowance import UsedAllowance
from cosim.choice.observer_scores import ObserverScore, gap_certified
from cosim.choice.ranking import MOST, NEAR, TIE, Row, allowed, contenders, ranked
from cosim.choice.rows import merged

ALLOWED = 10.0


def row(name: str, runs: list[tuple[float, float]], certified: bool, failed: bool = False, other: bool = False) -> Row:
    """An observer from shares and errors in runs."""
    gap = gap_certified(10.0 if certified else 0.1, 1.0, 1.0)
    used = {f"seed {i}": UsedAllowance(share, 1.0, rms, ALLOWED) for i, (share, rms) in enumerate(runs)}
    failures = {"seed 0": "diverged"} if failed and runs else {}
    score = ObserverScore(name, name, "m", "defaults", certificate=gap)
    return Row(
        score,
        cast(Any, SimpleNamespace(name=name, origin="defaults", model="m")),
        used,
        {},
        failures,
        ("made for another train",) if other else (),
    )


SHARES = st.one_of(st.sampled_from([0.0, 0.05, 0.3, 0.95, 1.2]), st.floats(0.0, 3.0))
ERRORS = st.one_of(st.sampled_from([0.0, 0.5, 5.0]), st.floats(0.0, 30.0))
RUNS = st.lists(st.tuples(SHARES, ERRORS), min_size=2, max_size=2)
LOST = st.sampled_from([False, False, False, True])
ONE = st.builds(row, st.uuids().map(str), RUNS, st.booleans(), LOST, st.booleans())
ONE_MORE = 1.0 + 1e-9
"""A run, and the rounding of shares: 28 / 37 + 1 / 37 is less than 29 / 37 by a bit."""
ROWS = st.lists(ONE, min_size=1, max_size=8, unique_by=lambda r: r.label)


@given(ROWS, st.randoms())
def test_the_order_does_not_depend_on_the_order_of_listing(rows: list[Row], chance: Any) -> None:
    shuffled = list(rows)
    chance.shuffle(shuffled)
    assert [r.label for r in ranked(rows)] == [r.label for r in ranked(shuffled)]


@given(ROWS)
def test_safe_ones_come_first_and_the_first_is_within_a_tie_of_the_smallest_error(rows: list[Row]) -> None:
    found = ranked(rows)
    safe = [r.safe for r in found]
    assert safe == sorted(safe, reverse=True)
    if found[0].safe:
        assert found[0].rms <= min(r.rms for r in found if r.safe) + TIE * ALLOWED
        close = [r for r in found if r.safe and r.rms <= min(r.rms for r in found if r.safe) + TIE * ALLOWED]
        tied = [r for r in close if r.share <= min(other.share for other in close) + TIE]
        assert found[0] in tied
        own = [r for r in tied if not r.remarks] or tied
        assert found[0] in own
        assert found[0].certified == any(r.certified for r in own)
    elif any(isfinite(r.rms) for r in found):  # all have the same number of runs
        rare = min(r.beyond for r in found if isfinite(r.rms)) + ONE_MORE / len(found[0].used)
        assert found[0].beyond <= rare
        close = [r for r in found if r.rms <= min(o.rms for o in found if o.beyond <= rare) + TIE * ALLOWED]
        assert found[0] in close
        assert found[0].share <= min(r.share for r in close if r.beyond <= rare) + TIE


@given(ROWS)
def test_those_that_may_be_the_best_are_all_that_are_near_it(rows: list[Row]) -> None:
    found, safe = contenders(rows), [r for r in ranked(rows) if r.safe]
    assert found[:1] == [r for r in ranked(rows) if isfinite(r.rms)][:1]
    assert all(r.rms <= max(NEAR * found[0].rms, found[0].rms + TIE * ALLOWED) for r in found)
    if safe:
        near = [r for r in safe if r.rms <= max(NEAR * safe[0].rms, safe[0].rms + TIE * ALLOWED)]
        assert found == near[:MOST]
    for one in found:
        assert safe or one.beyond <= min(r.beyond for r in rows if isfinite(r.rms)) + ONE_MORE / len(one.used)


@given(st.lists(st.tuples(st.integers(0, 36), ERRORS), min_size=1, max_size=6))
@example([(28, 0.5), (29, 0.0)])
@example([(0, 2.3e-309), (0, 0.0)])
def test_where_nothing_is_safe_the_smallest_error_of_what_fails_rarely_is_least_bad(found: list[Any]) -> None:
    """By any number of failures: one run more than the fewest is chance, two are not."""
    rows = [row(str(i), [(2.0 if k <= n else 0.5, e) for k in range(37)], False) for i, (n, e) in enumerate(found)]
    fewest = min(n for n, _ in found)
    first = int(ranked(rows)[0].label)
    assert found[first][0] <= fewest + 1
    assert found[first][1] == min(e for n, e in found if n <= fewest + 1)


@given(RUNS, RUNS)
def test_what_was_safe_until_a_further_seed_comes_before_what_never_was(few: list[Any], more: list[Any]) -> None:
    """However far beyond the allowance the further seed takes it: the other had no such seed."""
    early = row("early", [(2.0, error) for _, error in few], False)
    late = row("late", [*[(min(share, 1.0), error) for share, error in more], (9.0, 1.0)], False)
    assert [r.label for r in ranked([early, late])] == ["late", "early"]


@given(ROWS)
def test_rows_of_the_same_numbers_are_one_and_every_label_is_there_once(rows: list[Row]) -> None:
    found = merged(rows)
    assert sorted(label for r in found for label in (r.label, *r.also)) == sorted(r.label for r in rows)
    numbers = [tuple(r.used.items()) for r in found if not r.failures]
    assert len(set(numbers)) == len(numbers)
    for one in found:
        same = [r for r in rows if r.label in one.also]
        assert all(r.used == one.used for r in same)
        assert not one.remarks or all(r.remarks for r in same)


@given(RUNS, st.booleans())
def test_one_that_fails_in_a_run_that_counts_is_not_safe_and_says_why(runs: list[Any], certified: bool) -> None:
    lost = row("lost", runs, certified, failed=True)
    assert (lost.safe, lost.share, lost.rms) == (False, inf, inf)
    assert "diverged" in lost.why_not()


def test_one_that_was_not_tried_comes_last() -> None:
    left, bad = row("left", [], True), row("bad", [(9.0, 1.0)], False)
    assert [r.label for r in ranked([left, bad])] == ["bad", "left"]
    assert allowed([left, bad]) == ALLOWED
    assert bad.why_not({"seed 0": "after a wheel that jams at 3 s"}) == (
        "its gains are certified for gaps up to 0.100 s, here are 1.00 s; 9.00 times the allowance in seed 0 at 1 s, "
        "after a wheel that jams at 3 s (1 of 1 runs beyond it)"
    )
