"""Windows to look into, corrections at telegrams, and the numbers of each phase: hand-made runs with known answers."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic_run import OBSERVERS, synthetic_result, synthetic_spec

from cosim.evaluation.corrections import corrections, event_rows
from cosim.evaluation.phase_details import phase_details
from cosim.evaluation.spec import Phase, ReportSpec
from cosim.report.live.render import groups
from cosim.report.page.phases import phases_table
from cosim.report.zoom_windows import MOST, notable_windows
from cosim.results.result import BaliseRecord, Result

SPEC = ReportSpec(true_position="train.position", true_speed="train.speed", true_slip="train.slip", observers=["obs"])
EXACT = 1e-12  # sums of a hundred numbers of size 1
REPORTED = {"obs": "accepted"}


def telegram(
    stamp: float, delay: float = 0.0, kind: str = "true", outcome: str = "accepted", name: str = "B1"
) -> BaliseRecord:
    reported = {} if kind == "missed" else {"obs": outcome}
    return BaliseRecord(stamp, stamp + delay, name, 0.0, 0.0, kind=kind, outcomes=reported)  # type: ignore[arg-type]


def hand_made(
    events: tuple[BaliseRecord, ...] = (),
    position: np.ndarray | None = None,
    speed: np.ndarray | None = None,
    **more: np.ndarray,
) -> Result:
    """A run of 100 s with rows every 0.1 s, two at each delivery; the true values are zero, so that estimates are
    errors.
    """
    reported = [e.delivered_at for e in events if math.isfinite(e.delivered_at)]
    time = np.sort(
        np.concatenate([np.arange(1001) / 10, reported, [t for t in reported if t not in np.arange(1001) / 10]])
    )
    zero = np.zeros(len(time))
    columns = {"train.position": zero, "train.speed": zero, "train.slip": zero}
    columns |= {"obs.position": zero if position is None else position, "obs.speed": zero if speed is None else speed}
    columns |= {name.replace("__", "."): values for name, values in more.items()}
    table = np.empty(len(time), [("time", "f8"), *((name, "f8") for name in columns)])
    table["time"] = time
    for name, values in columns.items():
        table[name] = values
    return Result(table, [], events, {"step": 0.1})


def rows(events: tuple[BaliseRecord, ...] = ()) -> np.ndarray:
    return hand_made(events).time


def reasons(result: Result, spec: ReportSpec = SPEC) -> list[str]:
    return [reason for window in notable_windows(result, spec) for reason in window.reasons]


# --- corrections ------------------------------------------------------------------------------------------------------


def saw(events: tuple[BaliseRecord, ...], before: float, after: float) -> np.ndarray:
    """Zero, but `before` in the row before and `after` in the row after each delivery."""
    values = np.zeros(len(rows(events)))
    for event in events:
        first = int(np.flatnonzero(rows(events) == event.delivered_at)[0])
        values[first], values[first + 1] = before, after
    return values


def test_corrections_are_the_rows_before_and_after_the_delivery() -> None:
    events = (telegram(20.03, 0.2), telegram(40.07))
    made = corrections(hand_made(events, saw(events, 3.0, -1.0)), SPEC, "obs", "position")
    assert made.time.tolist() == pytest.approx([20.23, 40.07], abs=1e-12)
    assert (made.before.tolist(), made.after.tolist(), made.jump.tolist()) == ([3.0, 3.0], [-1.0, -1.0], [4.0, 4.0])


@pytest.mark.parametrize("unused", [telegram(20.03, kind="missed"), telegram(20.03, outcome="rejected")])
def test_telegrams_that_were_not_used_correct_nothing(unused: BaliseRecord) -> None:
    assert len(corrections(hand_made((unused,)), SPEC, "obs", "position").time) == 0


def test_an_event_between_rows_has_none() -> None:
    assert event_rows(np.array([0.0, 1.0, 1.0, 2.0]), 1.0) == (1, 2)
    assert event_rows(np.array([0.0, 1.0, 2.0]), 1.0) is None
    assert event_rows(np.array([0.0, 1.0, 1.0]), math.nan) is None


# --- windows ----------------------------------------------------------------------------------------------------------


def test_largest_errors_are_found_at_their_place() -> None:
    speed, position = np.zeros(1001), np.zeros(1001)
    speed[300], position[700] = -0.5, 2.0
    found = notable_windows(hand_made((), position, speed), SPEC)
    assert [(m.time, m.reasons) for m in found] == [
        (30.0, ("Largest speed error, -0.500 m/s (obs)",)),
        (70.0, ("Largest position error, 2.00 m (obs)",)),
    ]


def test_the_start_up_is_no_moment() -> None:
    speed = np.zeros(1001)
    speed[10], speed[500] = 9.0, 0.1
    assert reasons(hand_made((), None, speed), replace(SPEC, evaluate_after=5.0)) == [
        "Largest speed error, 0.100 m/s (obs)"
    ]


def test_telegrams_gone_wrong_are_windows() -> None:
    events = (
        telegram(10.0, name="ok"),
        telegram(30.0, kind="false", name="F"),
        telegram(50.0, 0.4, name="L"),
        telegram(70.0, outcome="rejected", name="R"),
        BaliseRecord(90.0, math.nan, "M", 0.0, 0.0, kind="missed"),
    )
    assert reasons(hand_made(events)) == [
        "A false telegram, F",
        "A telegram 400 ms late, L",
        "A telegram that not every observer took, R",
        "A missed balise, M",
    ]


def test_a_window_holds_stamp_and_delivery() -> None:
    (window,) = notable_windows(hand_made((telegram(50.0, 4.0),)), SPEC)
    assert window.start < 50.0
    assert window.end > 54.0


def test_the_largest_correction_is_a_moment() -> None:
    events = (telegram(20.0), telegram(60.0))
    position = saw(events, 1.0, 0.0)
    position[np.flatnonzero(rows(events) == 60.0)[0]] = 3.0
    assert "Largest correction at a balise, 3.00 m (obs)" in reasons(hand_made(events, position))


def test_zones_and_false_alarms_are_windows() -> None:
    indicator = np.where((np.arange(1001) > 800) & (np.arange(1001) < 850), 2.0, 1.0)
    found = notable_windows(hand_made(obs__slip_indicator=indicator), replace(SPEC, zones=[(30.0, 50.0)]))
    assert [m.reasons[0] for m in found] == [
        "A low-adhesion zone begins at 30.0 s",
        "A low-adhesion zone ends at 50.0 s",
        "Slip indicated outside every zone (obs)",
    ]
    assert found[2].time == pytest.approx(80.1)


def test_what_happens_together_is_one_window() -> None:
    speed = np.zeros(1001)
    speed[502] = 1.0
    (window, *_) = notable_windows(hand_made((), None, speed), replace(SPEC, zones=[(50.0, 90.0)]))
    assert window.reasons == ("Largest speed error, 1.00 m/s (obs)", "A low-adhesion zone begins at 50.0 s")


@pytest.mark.parametrize("rows_left_out", [0, 40])  # it ends in infinity, or well before
def test_the_worst_point_is_that_of_all_observers_and_then_that_of_those_that_work(rows_left_out: int) -> None:
    whole = synthetic_result(diverged="multirate_cdo")
    wild = replace(whole, table=whole.table[: len(whole.table) - rows_left_out])
    found = [reason for reason in reasons(wild, synthetic_spec()) if "error" in reason]
    worst = {reason.partition(",")[0] for reason in found if "(two CDOs)" in reason}
    assert worst == {"Largest speed error", "Largest position error"}
    assert any("(discrete_uio)" in reason for reason in found if reason.startswith("Largest speed error of the others"))


@given(st.integers(0, 20), st.floats(0.0, 60.0), st.sampled_from(OBSERVERS))
def test_windows_lie_in_the_run_and_hold_one_another_s_moment_never(seed: int, start: float, diverged: str) -> None:
    result = synthetic_result(step=0.5, seed=seed, diverged=diverged)
    found = notable_windows(result, replace(synthetic_spec(), evaluate_after=start))
    assert 1 <= len(found) <= MOST
    assert [m.time for m in found] == sorted(m.time for m in found)
    assert all(result.time[0] <= m.start <= m.time <= m.end <= result.time[-1] for m in found)
    assert not any(
        a is not b and a.start <= b.time <= a.end and b.start <= a.time <= b.end for a in found for b in found
    )


@pytest.mark.parametrize("count", [0, 1, 2])
def test_hardly_any_rows_have_no_moment(count: int) -> None:
    result = synthetic_result()
    assert notable_windows(replace(result, table=result.table[:count]), synthetic_spec()) == []


# --- phases -----------------------------------------------------------------------------------------------------------


def test_phase_details_of_constant_errors() -> None:
    events = (telegram(20.03), telegram(40.07), telegram(60.01, outcome="rejected"))
    time = rows(events)
    ones = np.ones(len(time))
    result = hand_made(
        events,
        saw(events, 3.0, -1.0),
        saw(events, 0.5, 0.25),
        obs__slip=0.02 * ones,
        train__coupler_force=ones,
        obs__coupler_force=4.0 * ones,
        train__adhesion_force=10.0 * ones,
        obs__adhesion_force=7.0 * ones,
        obs__slip_indicator=np.where((time >= 10.0) & (time < 15.0), 2.0, 1.0),
    )
    spec = replace(
        SPEC, true_adhesion_force="train.adhesion_force", phases=[Phase("first", 0, 50), Phase("last", 50, 100)]
    )
    first, last = phase_details(result, spec)
    assert (first.slip, first.adhesion_force, first.coupler_force) == pytest.approx((0.02, 3.0, 3.0), rel=EXACT)
    assert (first.position_before, first.position_after) == pytest.approx((3.0, 1.0), rel=EXACT)
    assert (first.speed_before, first.speed_after) == pytest.approx((0.5, 0.25), rel=EXACT)
    assert (first.indicator_on, first.telegrams) == (pytest.approx(0.1, rel=1e-9), 2)  # 5 of 50 s
    assert (last.position_before, last.indicator_on, last.telegrams) == (None, 0.0, 0)


def test_the_first_coupler_of_a_vector_is_meant() -> None:
    ones = np.ones(1001)
    result = hand_made(
        **{"train__coupler_force[1]": 5 * ones, "train__coupler_force[2]": 9 * ones, "obs__coupler_force": 3 * ones}
    )
    assert phase_details(result, SPEC)[0].coupler_force == pytest.approx(2.0, rel=EXACT)


def test_columns_without_numbers_are_left_out() -> None:
    assert not phases_table(phase_details(hand_made(), replace(SPEC, true_slip=None)), SPEC)
    table = phases_table(phase_details(synthetic_result(), synthetic_spec()), synthetic_spec())
    headings = [column.title() for column in table.columns]
    assert "Slip error, rms [1]" in headings
    assert not any("Coupler force" in heading for heading in headings)
    assert [len(rows) for _, rows in groups(table)] == [3] * len(OBSERVERS)  # one group each, of three phases
