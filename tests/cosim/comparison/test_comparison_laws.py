"""Laws of a comparison that hold for any signal."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from made_results import compared, kinds, made, signal

from cosim.comparison.compare import compare_results
from cosim.comparison.tolerance import Tolerance, Tolerances

ROWS = 40
TIME = np.arange(ROWS) * 0.1
ANY_VALUES = arrays(float, ROWS, elements=st.floats(-5.0, 5.0, width=32))
HELD = st.booleans()
AT_ONCE = Tolerance(absolute=0.5, relative=0.0, time=0.0)


def held_or_not(held: bool) -> dict[str, Any]:
    return {"discrete": ["y"] if held else []}


@given(arrays(float, ROWS, elements=st.floats(width=64)), HELD)
def test_a_result_is_equal_to_itself_whatever_it_holds(values: np.ndarray, held: bool) -> None:
    one = signal(TIME, values, values.copy(), Tolerance(0.0, 0.0, 0.0), **held_or_not(held))
    assert one.status == "equal"
    assert not one.findings


@settings(max_examples=40)
@given(arrays(float, ROWS, elements=st.floats(width=64)), arrays(float, ROWS, elements=st.floats(width=64)), HELD)
def test_any_numbers_can_be_compared(one: np.ndarray, two: np.ndarray, held: bool) -> None:
    """Infinities, NaN and numbers whose differences are infinite; warnings are errors here."""
    for every in (1, 3):
        comparison = compared(
            made(TIME, y=one, **held_or_not(held)), made(TIME[::every], y=two[::every], **held_or_not(held))
        )
        assert comparison["y"].passed == (not comparison["y"].findings)


@settings(max_examples=40)
@given(ANY_VALUES, ANY_VALUES, HELD)
def test_without_tolerance_any_other_value_differs(one: np.ndarray, two: np.ndarray, held: bool) -> None:
    status = signal(TIME, one, two, Tolerance(0.0, 0.0, 0.0), **held_or_not(held)).status
    assert (status == "equal") == bool(np.array_equal(one, two))
    assert status in ("equal", "differs")


@settings(max_examples=40)
@given(ANY_VALUES, ANY_VALUES, HELD)
def test_verdict_does_not_depend_on_which_is_the_reference(one: np.ndarray, two: np.ndarray, held: bool) -> None:
    there = signal(TIME, one, two, AT_ONCE, **held_or_not(held))
    back = signal(TIME, two, one, AT_ONCE, **held_or_not(held))
    assert there.passed == back.passed


@settings(max_examples=40)
@given(ANY_VALUES, st.floats(-0.6, 0.6), HELD)
def test_an_offset_passes_up_to_the_tolerance(values: np.ndarray, offset: float, held: bool) -> None:
    if abs(abs(offset) - 0.5) < 1e-9:  # rounding decides there
        return
    one = signal(TIME, values, values + offset, AT_ONCE, **held_or_not(held))
    assert one.passed == (abs(offset) < 0.5)
    assert one.max_error == pytest.approx(abs(offset), abs=1e-12)  # values up to five, in double precision
    assert one.rms_error == pytest.approx(abs(offset), abs=1e-12)
    assert one.share_outside == (0.0 if one.passed else 1.0)


@settings(max_examples=40)
@given(ANY_VALUES, ANY_VALUES, st.sampled_from([0.125, 4.0, 1024.0]), HELD)
def test_scaling_a_signal_scales_error_and_tolerance(one: np.ndarray, two: np.ndarray, by: float, held: bool) -> None:
    """By powers of two, so that nothing is rounded; 0.3 more, so that no signal of whole numbers is taken for an
    indicator.
    """
    relative = Tolerance(absolute=0.0, relative=0.1, time=0.05)
    small, large = (signal(TIME, f * (one + 0.3), f * (two + 0.3), relative, **held_or_not(held)) for f in (1.0, by))
    assert (large.status, kinds(large)) == (small.status, kinds(small))
    assert large.allowed == by * small.allowed
    assert large.max_error == by * small.max_error


@settings(max_examples=40)
@given(ANY_VALUES, st.sets(st.integers(0, ROWS - 2), max_size=10))
def test_more_rows_on_a_line_change_nothing(values: np.ndarray, where: set[int]) -> None:
    after = sorted(where)
    middle = 0.5 * (TIME[after] + TIME[[k + 1 for k in after]])
    time = np.sort(np.append(TIME, middle))
    full, more = made(TIME, y=values), made(time, y=np.interp(time, TIME, values))
    for comparison in (compared(full, more), compared(more, full)):
        assert comparison.equal
        assert comparison["y"].max_error <= 1e-12


@settings(max_examples=40)
@given(ANY_VALUES, st.sets(st.integers(1, ROWS - 2), max_size=10), HELD)
def test_a_row_twice_changes_nothing(values: np.ndarray, twice: set[int], held: bool) -> None:
    rows = np.sort(np.append(np.arange(ROWS), list(twice))).astype(int)
    again = made(TIME[rows], y=values[rows], **held_or_not(held))
    comparison = compared(made(TIME, y=values, **held_or_not(held)), again)
    assert comparison.equal
    assert comparison["y"].max_error <= 1e-12


def test_order_of_columns_and_of_rows_within_an_event_is_irrelevant() -> None:
    time = np.sort(np.append(TIME, [TIME[7]] * 3))
    a, b = np.sin(time) + (np.arange(len(time)) > 8), np.cos(time)
    swapped = a.copy()
    swapped[[8, 9]] = swapped[[9, 8]] + 3.0  # between before and after of one instant
    assert compared(made(time, a=a, b=b), made(time, b=b, a=swapped)).equal


@pytest.mark.parametrize("late", [0.02, -0.02, 0.08])
def test_a_smooth_signal_may_be_shifted_by_the_allowed_time(late: float) -> None:
    """A sine sampled a hundred times a second; what the allowed time leaves is the slope times the rest."""
    time = np.arange(0.0, 6.0, 0.01)
    tolerance = Tolerance(absolute=1e-4, relative=0.0, time=0.05)
    one = signal(time, np.sin(time), np.sin(time - late), tolerance)
    assert one.passed == (abs(late) < 0.05)
    if not one.passed:
        assert kinds(one)[0] == "value"
        assert one.max_error == pytest.approx(abs(late) - 0.05, rel=0.02)  # where the slope is one, within a sample


@given(st.integers(2, 9), HELD)
def test_every_nth_row_is_as_good(every: int, held: bool) -> None:
    """A baseline with fewer rows: the lines between them are not compared, only the points that are there."""
    time = np.arange(0.0, 6.0, 0.01)
    values = np.floor(10.0 * np.sin(time)) if held else np.sin(5.0 * time)
    keep = np.arange(len(time)) % every == 0
    keep[-1] = True
    full, thin = made(time, y=values, **held_or_not(held)), made(time[keep], y=values[keep], **held_or_not(held))
    assert compared(full, thin, Tolerance(1e-12, 0.0)).equal
    assert compared(thin, full, Tolerance(1e-12, 0.0)).equal


def test_a_different_value_is_found_in_a_thinned_baseline() -> None:
    time = np.arange(0.0, 6.0, 0.01)
    thin, full = made(time[::10], y=np.sin(time[::10])), made(time, y=np.sin(time) + 0.01 * (time > 3.0))
    found = [f for f in compared(thin, full)["y"].findings if f.kind == "value"]
    assert found[0].time == pytest.approx(3.1)
    assert found[0].size == pytest.approx(0.01, abs=2e-6)  # less the slope in the allowed time
    assert "too high" in found[0].text


def test_ten_thousand_rows_of_sixty_signals_need_no_quadratic_work() -> None:
    """Large tolerances in time: windows of thousands of rows, each point."""
    time = np.arange(20_000) * 0.01
    values = {f"s{k}": np.sin(time + k) for k in range(3)}
    wide = Tolerances(Tolerance(absolute=1e-3, relative=0.0, time=0.0, time_relative=0.2))
    comparison = compare_results(made(time, **values), made(time, **{n: v + 5e-4 for n, v in values.items()}), wide)
    assert comparison.equal
    assert all(signal.max_error == 0.0 or signal.max_error < 1e-3 for signal in comparison.signals)


@pytest.mark.parametrize(("wobble", "passes"), [(1e-6, True), (1e-7, True), (1e-4, False)])
def test_the_noise_of_a_solver_on_a_large_held_value_is_no_difference(wobble: float, passes: bool) -> None:
    """A pressure of one bar to a hundred billionth: two machines differ by that much, and no manoeuvre is so small."""
    time, noise = np.linspace(0.0, 10.0, 101), np.random.default_rng(0).uniform(-1.0, 1.0, (2, 101))
    reference, result = 101325.0 + wobble * noise
    assert signal(time, reference, result, Tolerance()).passed == passes


@given(st.sampled_from([1e3, 3e4, 7e5]), st.integers(0, 1), st.sampled_from([0.001, 0.005, 0.02, 0.1, 0.5, 1.0]))
def test_a_range_that_a_few_rows_set_is_said(spike: float, sign: int, share: float) -> None:
    time = np.arange(1001) * 0.1
    small = np.sin(time)
    large = np.where((time > 30.0) & (time < 30.45), (-1.0) ** sign * spike, 0.0)
    reference, result = made(time, y=large + small), made(time, y=large + (1.0 - share) * small)
    found = compared(reference, result, Tolerance(relative=1e-3))
    assert found.equal
    said = [note for note in found.notes if note.startswith("y: ")]
    assert bool(said) == (1e-3 * spike > np.std(small) and share > max(0.0071, min(1e-6 * spike, 0.36))), said
    assert all(note.startswith("y: 4 of 1001 rows set its range of ") for note in said)
    assert not compared(reference, made(time, y=large + small + 1e-6 * small), Tolerance(relative=1e-3)).notes
