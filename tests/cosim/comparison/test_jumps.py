"""Jumps: what is one, which is which, and what is said of late, missing and extra ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyfunnel  # type: ignore[import-untyped]
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_results import compared, kinds, made, signal

from cosim.comparison.alignment import _UNMATCHED, match_jumps
from cosim.comparison.curve import Curve, is_held
from cosim.comparison.jumps import Jumps, find_jumps, shifts
from cosim.comparison.tolerance import Tolerance

TIME = np.arange(201) * 0.01


def step_at(row: int, height: float = 5.0) -> np.ndarray:
    return np.where(np.arange(201) >= row, height, 0.0)


def rows_of_jumps(values: np.ndarray, time: np.ndarray = TIME, held: bool = False) -> list[int]:
    return [int(row) for row in find_jumps(Curve(time, values, held), 1e-4).row]


@pytest.mark.parametrize(
    "values",
    [
        TIME,
        np.maximum(TIME - 1.0, 0.0),
        np.minimum(TIME, 0.505),
        np.where(TIME < 1.0, 0.0, 1.0 - np.exp(-(TIME - 1.0) / 0.01)),  # a time constant of one sample
        np.exp(8.0 * TIME),
        np.sin(40.0 * TIME),
        np.random.default_rng(0).standard_normal(201),
    ],
    ids=["ramp", "kink", "saturation", "lag", "exponential", "sine", "noise"],
)
def test_smooth_signals_and_noise_have_no_jumps(values: np.ndarray) -> None:
    assert rows_of_jumps(values) == []


def test_noise_is_no_jump_in_many_samples() -> None:
    noise = np.random.default_rng(7).standard_normal(300_000)
    assert len(rows_of_jumps(noise, np.arange(len(noise)) * 0.01)) <= 1


def test_jumps_of_the_three_kinds() -> None:
    assert rows_of_jumps(step_at(100)) == [99]
    assert rows_of_jumps(step_at(100, 0.3) + TIME) == [99]  # thirty times the slope
    assert rows_of_jumps(TIME, held=True) == list(range(200))
    time = np.insert(TIME, 50, TIME[50])
    assert rows_of_jumps(np.insert(TIME, 50, TIME[50] - 0.001), time) == [50]
    assert rows_of_jumps(np.insert(TIME, 50, TIME[50]), time) == []


def test_indicators_are_held() -> None:
    assert is_held(step_at(100, 1.0) + 1.0)
    assert not is_held(step_at(100, 0.5))
    assert not is_held(np.arange(10.0))
    assert not is_held(np.append(np.zeros(100), np.arange(40.0)))


def jumps_at(times: list[float], before: list[float], after: list[float]) -> Jumps:
    at = np.array(times)
    return Jumps(np.arange(len(at)), at, at, np.array(before), np.array(after), np.zeros(len(at), bool))


@st.composite
def made_jumps(draw: st.DrawFn) -> Jumps:
    times = sorted(draw(st.lists(st.integers(0, 60), min_size=0, max_size=10, unique=True)))
    heights = [float(draw(st.integers(0, 3))) for _ in range(2 * len(times))]
    return jumps_at([0.1 * t for t in times], heights[::2], heights[1::2])


def naive_cost(a: Jumps, i: int, b: Jumps, j: int, window: float, allowed: float, scale: float) -> float:
    shift = abs(b.begin[j] - a.begin[i])
    off = abs(b.before[j] - a.before[i]), abs(b.after[j] - a.after[i])
    cost = shift / window
    if max(off) > allowed:
        height = max(abs(a.size[i]), abs(b.size[j])) or np.inf
        cost += 0.3 + 0.7 * min(abs(a.size[i] - b.size[j]) / height, 1.0) + min(0.25 * sum(off) / scale, 0.5)
    return float(cost) if shift <= window else np.inf


@given(made_jumps(), made_jumps(), st.sampled_from([0.15, 1.0, 10.0]))
def test_alignment_is_the_cheapest_one(a: Jumps, b: Jumps, window: float) -> None:
    """Against the plain recursion without a band; equal jumps at both ends are paired first, which costs nothing."""
    n, m = len(a), len(b)
    cost = np.array([[naive_cost(a, i, b, j, window, 0.5, 2.0) for j in range(m)] for i in range(n)]).reshape(n, m)
    best = _UNMATCHED * (np.arange(n + 1)[:, None] + np.arange(m + 1.0))
    for i in range(n):
        for j in range(m):
            best[i + 1, j + 1] = min(best[i, j + 1] + _UNMATCHED, best[i + 1, j] + _UNMATCHED, best[i, j] + cost[i, j])
    first, second = match_jumps(a, b, window=window, allowed=0.5, scale=2.0)
    assert np.all(np.diff(first) > 0)
    assert np.all(np.diff(second) > 0)
    found = cost[first, second].sum() + _UNMATCHED * (n + m - 2 * len(first))
    assert found == pytest.approx(best[n, m], abs=1e-9)  # sums of at most twenty costs


def test_ten_thousand_noisy_samples_one_late() -> None:
    """The alignment finds that all are late, although each has a neighbour at its own instant."""
    noise = np.cumsum(0.1 + np.random.default_rng(3).random(10_000)) % 7.0  # neighbours differ by 0.1 at least
    time = np.arange(10_000) * 0.01
    late = np.append(noise[0], noise[:-1])
    one = signal(time, noise, late, discrete=["y"])
    assert kinds(one) == ["jump_time"]
    assert one.findings[0].size == pytest.approx(0.01, abs=1e-9)
    assert "9998 jumps" in one.findings[0].text


def test_shift_of_a_jump_between_samples_is_not_overstated() -> None:
    a = jumps_at([0.0], [0.0], [1.0])
    one = Jumps(a.row, np.array([0.10]), np.array([0.11]), a.before, a.after, a.after_event)
    for begin, end, expected in [
        (0.11, 0.12, 0.01),
        (0.10, 0.20, 0.0),
        (0.0, 0.20, 0.0),
        (0.2, 0.4, 0.1),
        (0.0, 0.08, -0.03),
    ]:
        two = Jumps(a.row, np.array([begin]), np.array([end]), a.before, a.after, a.after_event)
        assert shifts(one, two)[0] == pytest.approx(expected, abs=1e-12)
        assert shifts(two, one)[0] == pytest.approx(-expected, abs=1e-12)


def test_step_one_sample_late_is_a_shift_and_with_pyfunnel_an_error_of_its_height(tmp_path: Path) -> None:
    one = signal(TIME, step_at(100), step_at(101))
    assert kinds(one) == ["jump_time"]
    assert one.findings[0].size == pytest.approx(0.01, abs=1e-12)
    assert one.max_error == 0.0
    assert one.max_shift == pytest.approx(0.01, abs=1e-12)
    pyfunnel.compareAndReport(TIME, step_at(100), TIME, step_at(101), str(tmp_path), atolx=1e-6, atoly=1e-3)
    errors = np.loadtxt(tmp_path / "errors.csv", delimiter=",", skiprows=1)[:, 1]
    assert errors.max() > 4.9  # of 5


@pytest.mark.parametrize("discrete", [[], ["y"]])
@pytest.mark.parametrize("rows", [1, 3, -2, 12])
def test_late_jump_is_one_finding_or_passes(rows: int, discrete: list[str]) -> None:
    moved = step_at(100 + rows)
    strict = signal(TIME, step_at(100), moved, discrete=discrete)
    assert kinds(strict) == ["jump_time"]
    assert strict.findings[0].size == pytest.approx(abs(0.01 * rows), abs=1e-9)
    assert ("late" if rows > 0 else "early") in strict.findings[0].text
    loose = signal(TIME, step_at(100), moved, Tolerance(1e-3, 0.0, time=abs(0.01 * rows)), discrete=discrete)
    assert loose.status == "within"
    assert loose.max_shift == pytest.approx(abs(0.01 * rows), abs=1e-9)


def test_event_row_late_and_values_after_it_are_evaluated() -> None:
    """A jump from 0 to 1 at 0.503 s and one at 0.506 s, then both rise; the second case is 0.01 too high after it."""

    def run(at: float, more: float) -> tuple[np.ndarray, np.ndarray]:
        time = np.sort(np.append(TIME, [at, at]))
        after = np.arange(len(time)) > np.searchsorted(time, at)
        return time, np.where(after, 1.0 + more + 0.1 * time, 0.0)

    reference, late, high = (
        made(time, y=values) for time, values in (run(0.503, 0.0), run(0.506, 0.0), run(0.506, 0.01))
    )
    one = compared(reference, late)["y"]
    assert kinds(one) == ["jump_time"]
    assert one.findings[0].size == pytest.approx(0.003, abs=1e-12)
    two = compared(reference, high, Tolerance(1e-3, 0.0, time=0.01))["y"]
    assert kinds(two) == ["value"]
    assert two.max_error == pytest.approx(0.01, abs=1.1e-3)  # beyond a tube that is 0.001 high: slope 0.1 times 0.01 s
    assert two.findings[0].time == pytest.approx(0.506)


def test_missing_and_extra_jumps() -> None:
    there, flat = step_at(100), np.zeros(201)
    missing, extra = signal(TIME, there, flat), signal(TIME, flat, there)
    assert set(kinds(missing)) == {"jump_missing", "value"}
    assert set(kinds(extra)) == {"jump_extra", "value"}
    value = next(finding for finding in missing.findings if finding.kind == "value")
    assert (value.time, value.end, value.size) == (1.0, 2.0, 5.0)


@pytest.mark.parametrize("discrete", [[], ["y"]])
def test_missing_pulse_of_one_sample_is_found(discrete: list[str]) -> None:
    pulse = np.where(np.arange(201) == 100, 1.0, 0.0)
    assert signal(TIME, pulse, np.zeros(201), discrete=discrete).status == "differs"
    assert signal(TIME, np.zeros(201), pulse, discrete=discrete).status == "differs"


def test_a_reset_seen_only_in_one_event_row_is_evaluated() -> None:
    """An innovation: it jumps at the event and decays; half as large is a value error although the time is right."""
    time = np.sort(np.append(TIME, TIME[100]))
    decay = np.where(np.arange(202) > 100, np.exp(-(time - 1.0) / 0.002), 0.0)
    one = signal(time, decay, 0.5 * decay)
    assert "value" in kinds(one)
    assert one.max_error == pytest.approx(0.5, abs=1e-9)
    assert one.max_error_at == 1.0


EVENT_TIME = np.sort(np.append(TIME, TIME[100]))
"""Both sides have the two rows of an event at 1 s, of rows 100 and 101."""


@pytest.mark.parametrize("discrete", [[], ["y"]])
def test_a_jump_at_an_event_that_comes_with_the_next_sample_is_late(discrete: list[str]) -> None:
    """After the event the late side still has the old value, so the jump is not merely somewhere between two
    samples.
    """
    rows = np.arange(202)
    at_event, late = np.where(rows > 100, 5.0, 0.0), np.where(rows > 101, 5.0, 0.0)
    for one, sign in (
        (signal(EVENT_TIME, at_event, late, discrete=discrete), "late"),
        (signal(EVENT_TIME, late, at_event, discrete=discrete), "early"),
    ):
        assert kinds(one) == ["jump_time"]
        assert one.findings[0].size == pytest.approx(0.01, abs=1e-12)
        assert sign in one.findings[0].text
    allowed = signal(EVENT_TIME, at_event, late, Tolerance(1e-3, 0.0, time=0.01), discrete=discrete)
    assert allowed.status == "within"


def test_a_pulse_seen_only_in_the_row_after_an_event_is_missed_by_nobody() -> None:
    flat = np.full(202, 4.5)
    pulse = np.where(np.arange(202) == 101, 14.5, 4.5)
    for one in (signal(EVENT_TIME, pulse, flat), signal(EVENT_TIME, flat, pulse)):
        assert "value" in kinds(one)
        assert one.max_error == pytest.approx(10.0, abs=2e-3)  # the pulse falls by 1e-3 in the allowed time
        assert one.max_error_at == 1.0


@pytest.mark.parametrize("row", [100, 101])
def test_nan_on_one_side_of_an_event_is_found(row: int) -> None:
    values = np.sin(EVENT_TIME)
    gap = np.where(np.arange(202) == row, np.nan, values)
    assert kinds(signal(EVENT_TIME, values, gap)) == ["nan"]
    assert kinds(signal(EVENT_TIME, gap, values)) == ["nan"]
    assert signal(EVENT_TIME, gap, gap + 1e-4).status == "within"


def test_a_sampled_ramp_with_one_percent_more_is_a_value_error_not_a_time_error() -> None:
    ramp = 14.0 * TIME + 1e-3 * np.random.default_rng(0).standard_normal(201)
    one = signal(TIME, ramp, 1.01 * ramp, Tolerance(1e-3, 1e-4), discrete=["y"])
    assert "value" in kinds(one)
    assert "jump_time" not in kinds(one)
    assert one.max_error == pytest.approx(0.01 * ramp[-1], rel=1e-9)


def test_jumps_seen_by_one_grid_only_are_not_taken_for_one_that_is_late() -> None:
    """The fine grid shows a jump at 1 s, which a ramp follows; the coarse one takes a steep ramp at 2 s for its only
    jump.
    """
    time = np.arange(301) * 0.01
    values = np.interp(time, [0.0, 0.995, 0.9951, 1.2, 2.0, 2.05, 3.0], [0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0])
    full, thin = made(time, y=values), made(time[::10], y=values[::10])
    assert len(find_jumps(Curve(time, values), 1e-3)) == len(find_jumps(Curve(time[::10], values[::10]), 1e-3)) == 1
    assert compared(full, thin)["y"].status == "within"
    assert compared(thin, full)["y"].status == "within"


@pytest.mark.parametrize("every", [2, 5, 10])
def test_thinned_signals_with_jumps_pass(every: int) -> None:
    """Samples held, steps, and events in their own rows, each compared with every n-th row of itself, both ways
    round.
    """
    time = np.sort(np.append(TIME, [0.503, 0.503, 1.207, 1.207]))
    rows = np.arange(len(time))
    event = np.isin(time, [0.503, 1.207])
    values = {
        "held": np.floor(time / 0.03) ** 2,
        "steps": np.where(rows > 80, 3.0, 0.0) + np.where(rows > 150, -2.0, 0.0) + 0.1 * time,
        "event": np.where(rows > 51, 1.0, 0.0) + np.where(rows > 123, 1.0, 0.0) + time,
    }
    keep = event | (rows % every == 0) | (rows == rows[-1])
    full = made(time, discrete=["held"], **values)
    thin = made(time[keep], discrete=["held"], **{name: v[keep] for name, v in values.items()})
    for one, two in [(full, thin), (thin, full)]:
        comparison = compared(one, two, Tolerance(1e-9, 0.0))
        assert comparison.equal, [f.text for s in comparison.signals for f in s.findings]
