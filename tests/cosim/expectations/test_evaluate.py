"""Every kind of expectation against a run whose numbers are known, met and not met, and against runs that went
wrong.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hand_made_run import AFTER, SPEC, TIME, columns, evaluated, hand_made
from hypothesis import given
from hypothesis import strategies as st

from cosim.errors import UnmetError
from cosim.evaluation.spec import ReportSpec
from cosim.expectations import Evaluated
from cosim.expectations.indicator_levels import first_on
from cosim.results.result import Result, SignalInfo
from cosim.results.results_folder import read_results, write_results
from cosim.run.outcome import Outcome

RMS = math.sqrt(0.5 * 0.5**2 + 0.5 * 0.1**2)  # 0.5 m/s for one half of the time, 0.1 m/s for the other

# what is expected, what is measured, when, and of which limits the first is met and the second not
ERRORS = [
    ({"check": "speed_error", "of": "observer"}, "max", 0.5, 0.0, (0.5, 0.49)),
    ({"check": "speed_error", "from": 6.0}, "max", 0.1, 6.0, (0.11, 0.09)),
    ({"check": "speed_error", "from": 5.0, "to": 7.0}, "max", 0.5, 5.0, (0.51, 0.49)),  # both rows of the event count
    ({"check": "speed_error"}, "rms", RMS, math.nan, (0.361, 0.360)),
    ({"check": "position_error"}, "max", 0.1, 10.0, (0.101, 0.099)),
    ({"check": "slip_error"}, "max", 0.25, 0.0, (0.25, 0.24)),
    ({"check": "adhesion_force_error"}, "max", 40.0, 7.0, (40.0, 39.0)),
    ({"check": "difference", "signal": "observer.speed", "reference": "other.speed"}, "max", 0.35, 5.0, (0.36, 0.34)),
]


BOUND = {"check": "bound", "signal": "observer.speed", "reference": "train.speed", "bound": "observer.bound"}
# the bound, the window, whether it is kept, its largest share, when, and what is said; the error is 0.5 m/s up to the
# event at 5 s and 0.1 m/s after it
BOUNDS = [
    (1.0, {}, True, 0.5, 0.0, "at most 50 % of the bound, 0.5000 m/s of 1.000 m/s (at 0 s)"),
    (0.5, {}, True, 1.0, 0.0, "at most 100 % of the bound"),
    (np.nextafter(0.5, 0.0), {}, False, 1.0, 0.0, "broken at 6 of 12 rows"),
    (0.25, {"from": 6.0}, True, 0.4, 6.0, "at most 40 % of the bound"),
    (0.25, {"from": 5.0}, False, 2.0, 5.0, "broken at 1 of 7 rows, 0.5000 m/s of 0.2500 m/s (worst at 5 s)"),
    (0.0, {}, False, np.finfo(float).max, 0.0, "broken at 12 of 12 rows"),
    (-1.0, {"from": 6.0}, False, np.finfo(float).max, 6.0, "broken at 5 of 5 rows"),
    (math.inf, {}, True, 0.0, 0.0, "at most 0 % of the bound"),
    (math.nan, {}, False, math.inf, 0.0, "not a number"),
]


@pytest.mark.parametrize(("bound", "window", "kept", "share", "when", "text"), BOUNDS)
def test_an_error_and_its_bound(
    bound: float, window: dict[str, float], kept: bool, share: float, when: float, text: str
) -> None:
    (found,) = evaluated(hand_made(changes={"observer.bound": np.full(12, bound)}), BOUND | window)
    assert found.passed is kept
    assert found.measured == pytest.approx(share, rel=1e-12)  # rounding of a quotient
    assert found.when == when
    assert text in found.text


def test_a_bound_that_was_kept_until_the_run_failed_is_not_met() -> None:
    bound = {"observer.bound": np.full(12, 1.0)}
    (found,) = evaluated(hand_made(7.0, "derailed", bound), BOUND)
    assert not found.passed
    assert "not reached" in found.text
    (found,) = evaluated(hand_made(7.0, "derailed", {"observer.bound": np.full(12, 0.2)}), BOUND)
    assert "broken at 6 of 9 rows" in found.text


@pytest.mark.parametrize(("item", "what", "measured", "when", "limits"), ERRORS)
def test_sizes_of_errors(
    item: dict[str, Any], what: str, measured: float, when: float, limits: tuple[float, float]
) -> None:
    met, unmet = (evaluated(hand_made(), item | {what: limit})[0] for limit in limits)
    assert (met.passed, unmet.passed) == (True, False)
    assert met.measured == pytest.approx(measured, rel=1e-12)  # rounding of sums of ten numbers
    assert unmet.limit == limits[1]
    assert unmet.when == pytest.approx(when, nan_ok=True)
    assert f"allowed {limits[1]:g}" in unmet.text
    assert unmet.margin == pytest.approx(1.0 - unmet.measured / limits[1], rel=1e-9)
    assert unmet.margin < 0.0 <= met.margin


SIGNALS = [
    ({"signal": "observer.speed"}, {"min": 9.9}, {"min": 9.91}, 9.9, 5.0),
    ({"signal": "observer.speed"}, {"max": 10.5}, {"max": 10.4}, 10.5, 0.0),
    ({"signal": "observer.speed", "from": 6.0}, {"max": 9.9}, {"max": 9.8}, 9.9, 6.0),
    ({"signal": "observer.position"}, {"final": [99.8, 99.95]}, {"final": [99.95, 101.0]}, 99.9, 10.0),
    ({"signal": "observer.speed", "to": 4.5}, {"final": [10.4, 10.6]}, {"final": [9.0, 10.0]}, 10.5, 4.0),
]


@pytest.mark.parametrize(("item", "met", "unmet", "measured", "when"), SIGNALS)
def test_bounds_of_signals(
    item: dict[str, Any], met: dict[str, Any], unmet: dict[str, Any], measured: float, when: float
) -> None:
    good, bad = (evaluated(hand_made(), {"check": "signal"} | item | bounds)[0] for bounds in (met, unmet))
    assert (good.passed, bad.passed) == (True, False)
    assert bad.measured == pytest.approx(measured)
    assert bad.margin < 0.0 <= good.margin
    assert bad.when == when
    assert bad.unit in ("m/s", "m")


INDICATORS = [
    ({"check": "on", "signal": "observer.indicator", "threshold": 0.5, "before": 6.0}, True, 6.0),
    ({"check": "on", "signal": "observer.indicator", "threshold": 0.5, "before": 5.9}, False, 6.0),
    # on already
    ({"check": "on", "signal": "observer.indicator", "threshold": 0.5, "from": 6.5, "before": 7.0}, True, 6.5),
    ({"check": "on", "signal": "observer.indicator", "threshold": 0.5, "from": 8.0, "before": 9.0}, False, math.nan),
    # above, not at
    ({"check": "on", "signal": "observer.indicator", "threshold": 1.0, "before": 9.0}, False, math.nan),
    ({"check": "on", "signal": "alarm.indicator", "threshold": 1.5, "before": 5.0}, True, 5.0),
    ({"check": "off", "signal": "observer.indicator", "threshold": 0.5, "to": 5.0}, True, 0.0),
    ({"check": "off", "signal": "observer.indicator", "threshold": 0.5}, False, 2.0),
    # still on at its start
    ({"check": "off", "signal": "observer.indicator", "threshold": 0.5, "from": 7.5}, False, 0.5),
    ({"check": "off", "signal": "observer.indicator", "threshold": 0.5, "from": 8.0}, True, 0.0),
    ({"check": "off", "signal": "alarm.indicator", "threshold": 1.5}, False, 3.0),
]


@pytest.mark.parametrize(("item", "passed", "measured"), INDICATORS)
def test_indicators(item: dict[str, Any], passed: bool, measured: float) -> None:
    (found,) = evaluated(hand_made(), item)
    assert found.passed is passed
    assert found.measured == pytest.approx(measured, nan_ok=True)
    assert (found.margin >= 0.0) is passed


MARGINS = [  # on from 6 s up to 8 s, in a run of 10 s
    ({"check": "off", "threshold": 0.5}, -0.2),  # for 2 s of it
    ({"check": "off", "threshold": 0.5, "from": 9.0}, 0.2),  # the last row on is that of 7 s, 2 s before
    ({"check": "off", "threshold": 0.5, "to": 5.0}, 0.1),  # 1 s after it
    ({"check": "off", "threshold": 4.0}, 1.75),  # never on, at most at 1
    ({"check": "on", "threshold": 0.5, "before": 8.0}, 0.25),  # 2 s before
    ({"check": "on", "threshold": 0.5, "from": 1.0, "before": 5.0}, -0.25),  # 1 s late, of 4 s
    ({"check": "on", "threshold": 4.0, "before": 8.0}, -1.75),
]


@pytest.mark.parametrize(("item", "margin"), MARGINS)
def test_an_indicator_is_nearer_to_being_wrong_the_nearer_it_is_in_time(item: dict[str, Any], margin: float) -> None:
    (found,) = evaluated(hand_made(), item | {"signal": "observer.indicator"})
    assert found.margin == pytest.approx(margin, rel=1e-12)


def test_what_is_no_number_is_farthest_and_what_was_not_measured_is_nowhere() -> None:
    (found,) = evaluated(
        hand_made(changes={"observer.speed": np.full(12, math.nan)}), {"check": "speed_error", "max": 1}
    )
    assert found.margin == -math.inf
    (found,) = evaluated(hand_made(), {"check": "speed_error", "max": 1, "from": 9.0})
    assert math.isnan(found.margin)


TELEGRAMS = [
    ({"missed": 1}, [True], [1]),
    ({"missed": 0}, [False], [1]),
    ({"false": 0}, [False], [1]),
    ({"false": 0, "from": 2.5}, [True], [0]),
    ({"rejected": 0}, [False, True], [1, 0]),  # observer, other
    ({"ignored": 0}, [True, True], [0, 0]),
    ({"doubted": 0}, [True, True], [0, 0]),
    ({"rejected": 0, "of": "other"}, [True], [0]),
    ({"late": 0}, [False, True], [1, 0]),
    ({"undelivered": 0, "of": "observer"}, [False], [1]),
    ({"used": 3}, [False, True], [2, 3]),
    ({"used": 3, "to": 5.0, "of": "other"}, [False], [2]),
    ({"missed": 1, "used": 2, "of": "observer"}, [True, True], [1, 2]),
]


@pytest.mark.parametrize(("item", "passed", "counts"), TELEGRAMS)
def test_telegrams(item: dict[str, Any], passed: list[bool], counts: list[int]) -> None:
    found = evaluated(hand_made(), {"check": "telegrams"} | item)
    assert [j.passed for j in found] == passed
    assert [j.measured for j in found] == counts


def test_what_a_gate_ignored_was_not_taken() -> None:
    """No receiver rejected it by a policy for late ones, and yet none of them is "not rejected"."""
    run = hand_made()
    true = [e for e in run.events if e.kind == "true"]
    ignored = replace(run, events=[*true, replace(true[0], stamp=3.5, outcomes={"other": "ignored"})])
    (rejected, doubts, used) = (
        evaluated(ignored, {"check": "telegrams", "of": "other"} | item)[0]
        for item in ({"rejected": 0}, {"ignored": 1}, {"used": 4})
    )
    assert (rejected.passed, rejected.measured) == (False, 1.0)
    assert (doubts.passed, doubts.measured) == (True, 1.0)
    assert not used.passed


def test_telegrams_that_are_too_many_are_named() -> None:
    (found,) = evaluated(hand_made(), {"check": "telegrams", "false": 0})
    assert "B at 2 s" in found.text
    assert found.when == 2.0


@pytest.mark.parametrize(("of", "passed"), [("observer", True), ("other", False), ("third", True)])
def test_certificates(of: str, passed: bool) -> None:
    (found,) = evaluated(hand_made(), {"check": "certificate", "of": of})
    assert found.passed is passed


def test_a_longer_gap_than_certified_is_found() -> None:
    run = hand_made()
    certificates = run.summary["certificates"]
    longer = {**certificates, "observer": {**certificates["observer"], "largest_gap_seen": 3.75}}
    (found,) = evaluated(
        replace(run, summary={**run.summary, "certificates": longer}), {"check": "certificate", "of": "observer"}
    )
    assert (found.passed, found.measured, found.limit) == (False, 3.75, 3.5)


def test_certificates_of_all_observers() -> None:
    assert [j.passed for j in evaluated(hand_made(), {"check": "certificate"})] == [True, False, True]
    bare = replace(hand_made(), summary={})
    assert [j.passed for j in evaluated(bare, {"check": "certificate"})] == [False]


def test_warnings() -> None:
    good, bad = evaluated(hand_made(), {"check": "warnings", "at_most": 2}, {"check": "warnings", "at_most": 1})
    assert (good.passed, bad.passed, bad.measured) == (True, False, 2.0)
    assert "the rails are wet" in bad.text


def test_errors_count_from_the_start_of_the_evaluation() -> None:
    late = replace(SPEC, evaluate_after=6.0)
    (after,) = evaluated(hand_made(), {"check": "speed_error", "max": 0.2}, spec=late)
    (before,) = evaluated(hand_made(), {"check": "speed_error", "max": 0.2, "from": 0.0}, spec=late)
    assert (after.passed, before.passed) == (True, False)


def test_several_observers_are_evaluated_one_by_one() -> None:
    found = evaluated(hand_made(), {"check": "speed_error", "of": ["observer", "other"], "max": 0.3, "name": "fast"})
    assert [(j.passed, j.number) for j in found] == [(False, 1), (True, 1)]
    assert all(j.name.startswith("fast (") for j in found)


# -- runs that went wrong
# -----------------------------------------------------------------------------------------------

REACHED_AND_OPEN = [
    ({"check": "speed_error", "max": 1.0}, False, "not reached"),
    ({"check": "speed_error", "max": 0.4}, False, "0.5"),
    ({"check": "speed_error", "max": 1.0, "to": 3.0}, True, ""),
    ({"check": "speed_error", "max": 1.0, "from": 8.0}, False, "not reached"),
    ({"check": "speed_error", "rms": 1.0}, False, "not reached"),
    ({"check": "signal", "signal": "train.speed", "max": 11.0}, False, "not reached"),
    ({"check": "signal", "signal": "train.speed", "final": [9.0, 11.0]}, False, "not reached"),
    ({"check": "signal", "signal": "train.speed", "final": [9.0, 11.0], "to": 4.0}, True, ""),
    ({"check": "signal", "signal": "train.speed", "final": [1.0, 2.0]}, False, "so far"),
    ({"check": "on", "signal": "observer.indicator", "threshold": 0.5, "before": 9.0}, True, ""),
    ({"check": "on", "signal": "observer.indicator", "threshold": 1.5, "before": 9.0}, False, "not reached"),
    ({"check": "on", "signal": "observer.indicator", "threshold": 1.5, "before": 5.0}, False, "never on"),
    ({"check": "off", "signal": "observer.indicator", "threshold": 1.5}, False, "not reached"),
    ({"check": "off", "signal": "observer.indicator", "threshold": 0.5}, False, "first at 6"),
    ({"check": "telegrams", "missed": 1}, False, "not reached"),
    ({"check": "telegrams", "used": 2, "of": "observer"}, True, ""),
    ({"check": "telegrams", "used": 3, "of": "observer"}, False, "not reached"),
    ({"check": "certificate", "of": "observer"}, False, "not reached"),
    ({"check": "warnings", "at_most": 5}, False, "not reached"),
]


@pytest.mark.parametrize(("item", "passed", "text"), REACHED_AND_OPEN)
def test_a_run_that_failed_at_6_s(item: dict[str, Any], passed: bool, text: str) -> None:
    (found,) = evaluated(hand_made(until=6.0, failure="the wheel came off"), item)
    assert found.passed is passed
    assert text in found.text


def test_a_run_that_ended_as_a_component_asked_is_evaluated_by_what_there_is() -> None:
    ended = hand_made(until=6.0)
    (whole,) = evaluated(ended, {"check": "speed_error", "max": 1.0})
    (asked,) = evaluated(ended, {"check": "speed_error", "max": 1.0, "to": 9.0})
    assert (whole.passed, asked.passed) == (True, False)


def test_a_run_without_rows() -> None:
    empty = hand_made(until=-1.0, failure="nothing worked")
    found = evaluated(
        empty,
        {"check": "speed_error", "max": 1.0},
        {"check": "signal", "signal": "train.speed", "min": 0.0},
        {"check": "on", "signal": "observer.indicator", "before": 3.0},
        {"check": "off", "signal": "observer.indicator"},
        {"check": "telegrams", "missed": 0, "used": 1},
        {"check": "warnings", "at_most": 9},
    )
    assert not any(j.passed for j in found)
    assert all(j.text for j in found)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(
    "item",
    [
        {"check": "speed_error", "max": 9.0},
        {"check": "speed_error", "rms": 9.0},
        {"check": "difference", "signal": "observer.speed", "reference": "other.speed", "max": 9.0},
        {"check": "signal", "signal": "observer.speed", "min": -9.0},
        {"check": "signal", "signal": "observer.speed", "max": 99.0},
    ],
)
def test_what_is_not_finite_is_never_within_bounds(value: float, item: dict[str, Any]) -> None:
    run = hand_made(changes={"observer.speed": np.where(TIME == 7.0, value, 10.0)})
    (found,) = evaluated(run, item)
    assert not found.passed
    assert found.when == 7.0
    (before,) = evaluated(run, item | {"to": 6.0})
    assert before.passed


def test_an_indicator_that_is_not_a_number_is_not_off() -> None:
    run = hand_made(changes={"alarm.indicator": np.where(TIME == 7.0, math.nan, 1.0)})
    (found,) = evaluated(run, {"check": "off", "signal": "alarm.indicator", "threshold": 1.5})
    assert (found.passed, found.when) == (False, 7.0)


def test_a_window_between_two_rows_is_said_to_hold_none() -> None:
    (found,) = evaluated(hand_made(), {"check": "speed_error", "max": 1.0, "from": 6.2, "to": 6.8})
    assert not found.passed
    assert "no row between 6.2 and 6.8 s" in found.text


@pytest.mark.parametrize(
    "item", [{"check": "speed_error", "of": "nobody", "max": 1.0}, {"check": "signal", "signal": "a.b", "min": 0.0}]
)
def test_what_was_not_recorded_is_said(item: dict[str, Any]) -> None:
    (found,) = evaluated(hand_made(), item)
    assert not found.passed
    assert "was not recorded" in found.text


def test_without_a_true_value_nothing_is_measured() -> None:
    (found,) = evaluated(hand_made(), {"check": "speed_error", "max": 1.0}, spec=ReportSpec(observers=("observer",)))
    assert "true_speed" in found.text


# -- laws
# ---------------------------------------------------------------------------------------------------------------

times = st.lists(st.integers(0, 40), min_size=2, max_size=25).map(sorted)


@given(times, st.data())
def test_the_largest_error_is_that_of_a_plain_loop(ticks: Sequence[int], data: st.DataObject) -> None:
    time = [tick / 4.0 for tick in ticks]
    errors = data.draw(st.lists(st.integers(-8, 8), min_size=len(time), max_size=len(time)))
    start, end = sorted(data.draw(st.tuples(st.integers(0, 39), st.integers(0, 39)).filter(lambda p: p[0] != p[1])))
    limit = data.draw(st.integers(0, 8))
    sizes = [abs(e) for t, e in zip(time, errors, strict=True) if start <= 4.0 * t <= end]
    table = np.array(
        list(zip(time, errors, [0.0] * len(time), strict=True)), [("time", "f8"), ("a.b", "f8"), ("a.c", "f8")]
    )
    run = Result(table, [SignalInfo("a.b"), SignalInfo("a.c")])
    item = {
        "check": "difference",
        "signal": "a.b",
        "reference": "a.c",
        "max": limit,
        "from": start / 4.0,
        "to": end / 4.0,
    }
    (found,) = evaluated(run, item)
    assert found.passed is (bool(sizes) and max(sizes) <= limit and 4.0 * time[-1] >= end)


@given(times, st.data())
def test_first_on_is_that_of_a_fine_walk(ticks: Sequence[int], data: st.DataObject) -> None:
    """Walks in quarters of a tick and looks up the row that holds there; what is seen for no time does not count in a
    walk.
    """
    unique = sorted(set(ticks))
    values = data.draw(st.lists(st.sampled_from([0.0, 1.0]), min_size=len(unique), max_size=len(unique)))
    start = data.draw(st.integers(unique[0], unique[-1] * 4 + 3)) / 4.0
    walk = (start + k / 4.0 for k in range(200))
    held = ((t, [v for u, v in zip(unique, values, strict=True) if u <= t]) for t in walk)
    expected = next((t for t, before in held if before and before[-1] > 0.5), None)
    first = first_on(np.array(unique, dtype=float), np.array(values), 0.5, start)
    if start >= unique[0]:
        assert first == expected


# -- the outcome
# --------------------------------------------------------------------------------------------------------


def outcome(*items: dict[str, Any], failure: str | None = None) -> Outcome:
    run = hand_made(failure=failure)
    found = [j.to_data() for j in evaluated(run, *items)]
    return Outcome(run, SPEC).with_summary(expectations=found)


def test_an_outcome_knows_what_is_unmet() -> None:
    mixed = outcome({"check": "speed_error", "max": 1.0}, {"check": "speed_error", "max": 0.1, "name": "a dream"})
    assert [j.passed for j in mixed.expectations] == [True, False]
    assert [(j.name, j.number) for j in mixed.unmet] == [("a dream", 2)]
    text = mixed.expectations_text().splitlines()
    assert text[0] == "1 of 2 expectations not met:"
    assert text[3].split()[:4] == ["not", "met", "a", "dream"]
    with pytest.raises(AssertionError, match="a dream"):
        mixed.check()


def test_an_outcome_that_is_as_expected_passes_the_check() -> None:
    good = outcome({"check": "speed_error", "max": 1.0})
    assert good.check() is good
    assert good.expectations_text().startswith("The expectation is met:")
    bare = Outcome(hand_made(), SPEC)
    assert bare.check() is bare
    assert bare.expectations_text() == ""


def test_a_run_that_failed_does_not_pass_the_check() -> None:
    with pytest.raises(UnmetError, match="the wheel came off"):
        outcome({"check": "warnings", "at_most": 5}, failure="the wheel came off").check()


def test_expectations_survive_the_results_folder(tmp_path: Any) -> None:
    before = outcome(
        {"check": "speed_error", "max": 1.0, "rms": 0.1},
        {"check": "certificate"},
        {"check": "on", "signal": "observer.indicator", "threshold": 9.0, "before": 3.0},
    )
    write_results(before.result, tmp_path)
    after = Outcome(read_results(tmp_path), SPEC)
    equal = [
        replace(a, measured=0.0, when=0.0) == replace(b, measured=0.0, when=0.0) for a, b in zip_all(before, after)
    ]
    assert equal == [True] * 6
    for key in ("measured", "when"):
        read, written = ([getattr(j, key) for j in side.expectations] for side in (after, before))
        np.testing.assert_array_equal(read, written)


def zip_all(before: Outcome, after: Outcome) -> list[tuple[Evaluated, Evaluated]]:
    return list(zip(before.expectations, after.expectations, strict=True))


def test_the_hand_made_run_is_what_it_says() -> None:
    error = columns()["observer.speed"] - columns()["train.speed"]
    assert sorted(set(np.round(error, 9))) == [-0.1, 0.5]
    assert TIME[AFTER][0] == 5.0


def test_a_text_names_the_unit_in_which_pages_show_the_signal_and_the_limit_as_it_is_stated() -> None:
    """What is judged, and stands in data, stays in SI; a difference has no offset."""
    run = hand_made(changes={"plant.T": 293.15 + TIME, "plant.set": np.full(12, 293.15)})
    shown = {"train.speed": "km/h", "observer.speed": "km/h", "plant.T": "degC"}
    kept = {"plant.T": "K", "plant.set": "K"}
    signals = [replace(s, display_unit=shown.get(s.name), unit=kept.get(s.name, s.unit)) for s in run.signals]
    items = [
        {"check": "signal", "signal": "train.speed", "max": 5.0},
        {"check": "signal", "signal": "plant.T", "final": [273.15, 283.15]},
        {"check": "difference", "signal": "plant.T", "reference": "plant.set", "max": 5.0},
        BOUND | {"bound": "other.speed"},
    ]
    speed, warm, warmer, bound = evaluated(Result(run.table, signals), *items)
    assert (speed.measured, speed.limit, speed.unit) == (10.0, 5.0, "m/s")
    assert speed.text == "36.00 km/h (at 0 s), expected at most 18 km/h (5 m/s)"
    assert (warm.measured, warm.unit) == (303.15, "K")
    assert warm.text == "30.00 degC (at 10 s), expected 0 degC (273.15 K) to 10 degC (283.15 K)"
    assert warmer.text == "10.00 degC (at 10 s), allowed 5 degC (5 K)"
    assert "1.800 km/h of 36.90 km/h" in bound.text
