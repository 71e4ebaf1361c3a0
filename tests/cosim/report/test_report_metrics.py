"""Report metrics against closed forms; scales, counts and numbers by their laws."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from synthetic_run import OBSERVERS, synthetic_result, synthetic_spec

from cosim.evaluation.event_counts import accepted_stamps, count_events
from cosim.evaluation.indicators import indicator_statistics, on_intervals
from cosim.evaluation.metrics import error_size, phase_metrics
from cosim.evaluation.spec import Phase, ReportSpec
from cosim.report.figures.scales import error_scale, running_maximum, value_limits
from cosim.report.page.run_tables import _indicators
from cosim.results.result import BaliseRecord, Result
from fmus.tables.numbers import error_number, number

EXACT = 1e-12  # closed forms, up to the rounding of some thousand sums


def small_result(time: list[float], events: tuple[BaliseRecord, ...] = (), **columns: list[float]) -> Result:
    table = np.empty(len(time), [("time", "f8"), *((name.replace("__", "."), "f8") for name in columns)])
    table["time"] = time
    for name, values in columns.items():
        table[name.replace("__", ".")] = values
    return Result(table, [], events)


# --- size of an error -------------------------------------------------------------------------------------------------


def test_sine_has_rms_amplitude_over_root_two() -> None:
    time = np.linspace(0, 2 * np.pi, 1001)  # the trapezoidal rule is exact for whole periods of a sine
    size = error_size(time, 0.3 * np.sin(time))
    assert_allclose(size.rms, 0.3 / math.sqrt(2), rtol=EXACT)
    assert_allclose(size.max_abs, 0.3, rtol=1e-5)  # the nearest sample is up to 0.0031 rad from the top


def test_rms_of_a_constant_is_the_constant_on_any_time_axis() -> None:
    time = np.array([0, 0.1, 0.1, 0.1, 3.0, 3.0001])
    assert_allclose(error_size(time, np.full(6, -0.7)).rms, 0.7, rtol=EXACT)


def test_rms_weighs_by_time() -> None:
    time, error = np.array([0, 1, 1, 4.0]), np.array([2, 2, 0, 0.0])  # 2 for 1 s, then 0 for 3 s
    assert_allclose(error_size(time, error).rms, 1.0, rtol=EXACT)


@given(st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=10), st.integers(0, 9), st.integers(1, 5))
def test_repeated_rows_count_once(values: list[float], where: int, times: int) -> None:
    error, time = np.array(values), np.arange(len(values), dtype=float)
    row = where % len(values)
    repeated = error_size(np.insert(time, row, [time[row]] * times), np.insert(error, row, [error[row]] * times))
    plain = error_size(time, error)
    assert_allclose([repeated.max_abs, repeated.rms], [plain.max_abs, plain.rms], rtol=EXACT, atol=1e-300)


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=10))
def test_rms_never_exceeds_the_maximum_nor_overflows(values: list[float]) -> None:
    size = error_size(np.arange(len(values), dtype=float), np.array(values))
    assert 0 <= size.rms / (1 + EXACT) <= size.max_abs < math.inf


@pytest.mark.parametrize("bad", [math.inf, -math.inf, math.nan])
def test_error_that_is_not_finite_has_diverged(bad: float) -> None:
    size = error_size(np.array([0.0, 1.0, 2.0]), np.array([0.0, bad, 0.0]))
    assert (size.max_abs, size.rms) == (math.inf, math.inf)


def test_one_row_and_no_row() -> None:
    assert error_size(np.array([1.0]), np.array([-2.0])).rms == 2.0
    assert math.isnan(error_size(np.array([]), np.array([])).rms)


# --- phases -----------------------------------------------------------------------------------------------------------


def test_phases_and_start_of_the_evaluation_choose_the_rows() -> None:
    # four instants from 4 s on, one of them with an event
    time = [0.0, 1.0, 2.0, 2.25, 2.5, 2.75, 3.0, 4.0, 4.0, 5.0, 6.0, 7.0]
    result = small_result(
        time, true__v=[0.0] * 12, obs__speed=[9.0, 5.0, -1.0, 2.0, 2.0, 2.0, 2.0, 7.0, 7.0, 7.0, 7.0, 7.0]
    )
    spec = ReportSpec(
        true_speed="true.v",
        observers=["obs"],
        phases=[Phase("a", 0, 3), Phase("b", 4, 9), Phase("c", 20, 30)],
        evaluate_after=2.0,
        published={"obs": {"a": 0.5}},
    )
    first, second, third = phase_metrics(result, spec)
    assert first.speed is not None
    assert first.speed.max_abs == 2.0
    assert_allclose(first.speed.rms, math.sqrt(0.25 * 2.5 + 0.75 * 4), rtol=EXACT)  # trapezoids over one second
    assert (first.published, first.independent, first.position) == (0.5, None, None)
    for entry in (second, third):  # too few rows, and none
        assert entry.speed is not None
        assert math.isnan(entry.speed.max_abs)
        assert math.isnan(entry.speed.rms)


def test_without_phases_the_whole_run_is_evaluated() -> None:
    result = small_result(range(5), true__p=[1.0] * 5, obs__position=[2.0] * 5)
    (entry,) = phase_metrics(result, ReportSpec(true_position="true.p", observers=["obs"]))
    assert (entry.phase, entry.speed) == ("whole run", None)
    assert entry.position is not None
    assert entry.position.rms == 1.0


# --- slip indicators --------------------------------------------------------------------------------------------------


def test_indicator_holds_until_the_next_row() -> None:
    time, values = np.array([0, 1, 2, 2, 5, 6.0]), np.array([1, 2, 2, 1, 2, 2.0])
    assert on_intervals(time, values) == [(1.0, 2.0), (5.0, 6.0)]


def test_indicator_shares_and_delays() -> None:
    time = [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]
    result = small_result(time, obs__slip_indicator=[2, 1, 2, 1, 2, 1])  # on in [0,2], [4,6], [8,10]
    spec = ReportSpec(observers=["obs", "other"], zones=[(3, 6), (6, 7), (9, 10)], evaluate_after=1.0)
    (statistics,) = indicator_statistics(result, spec)
    assert statistics.delays == (1.0, None, 0.0)
    assert_allclose(statistics.on, 5 / 9, rtol=EXACT)  # 1 + 2 + 2 of 9 seconds
    assert_allclose(statistics.on_outside, 2 / 4, rtol=EXACT)  # [1,2] and [8,9] of [1,3], [7,9]


def test_a_zone_that_the_run_does_not_reach_is_not_called_one_without_indication() -> None:
    result = small_result([0.0, 8.0, 10.0], obs__slip_indicator=[1, 2, 2])
    table = _indicators(result, ReportSpec(observers=["obs"], zones=[(2, 4), (7, 9), (10, 12)]))
    ((*_, missed, seen, later),) = table.cells
    assert (missed, seen, later) == ("not indicated", "1.00", "not reached")


# --- telegrams --------------------------------------------------------------------------------------------------------


def test_telegrams_are_counted_by_kind_and_outcome() -> None:
    events = (
        BaliseRecord(1.0, 1.1, "a", 0, 0, outcomes={"x": "accepted", "y": "rejected"}),
        BaliseRecord(2.0, math.nan, "b", 0, 0, kind="missed"),
        BaliseRecord(3.0, 3.0, "c", 9, 0, kind="false", outcomes={"x": "rejected", "y": "rejected"}),
        BaliseRecord(0.5, 3.0, "d", 0, 0, outcomes={"x": "replayed", "y": "late"}),
    )
    counts = count_events(events)
    assert (counts.delivered, counts.missed, counts.false) == (3, 1, 1)
    assert counts.outcomes == {"x": {"accepted": 1, "rejected": 1, "replayed": 1}, "y": {"rejected": 2, "late": 1}}
    assert accepted_stamps(events) == [0.5, 1.0]
    assert accepted_stamps(events, "y") == [0.5]


# --- scales and numbers -----------------------------------------------------------------------------------------------


def test_diverged_curve_does_not_set_the_scale() -> None:
    wave = np.sin(np.linspace(0, 20, 500))
    alone, together = error_scale([0.02 * wave]), error_scale([0.02 * wave, 1e4 * wave, np.full(500, math.nan)])
    assert together == alone
    assert_allclose(alone.limit, 0.02 * 1.3, rtol=1e-3)  # the samples miss the top of the sine by less


def test_single_spike_does_not_set_the_scale() -> None:
    wave = np.sin(np.linspace(0, 20, 500))
    spiked = wave.copy()
    spiked[100] = 1e6
    assert error_scale([spiked]).limit < 5


def test_sizes_far_apart_get_a_logarithmic_axis_and_all_fit() -> None:
    wave = np.sin(np.linspace(0, 20, 500))
    scale = error_scale([0.001 * wave, 0.02 * wave, 0.1 * wave])
    assert scale.floor is not None
    assert scale.floor < 0.001
    assert scale.limit > 0.1


@given(st.lists(st.lists(st.floats(), max_size=5), max_size=4))
def test_scales_are_always_usable(curves: list[list[float]]) -> None:
    arrays = [np.array(c) for c in curves]
    scale = error_scale(arrays)
    assert 0 < scale.limit < math.inf
    assert scale.floor is None or 0 < scale.floor < scale.limit
    limits = value_limits(arrays[:1], arrays[1:])
    assert limits is None or -math.inf < limits[0] < limits[1] < math.inf


def test_running_maximum_takes_the_largest_of_each_window() -> None:
    middles, sizes = running_maximum(np.array([0, 0.4, 1.1, 1.1, 3.2]), np.array([1, -3, 2, math.nan, 0.5]), 1.0)
    assert middles.tolist() == [0.5, 1.5, 3.5]
    assert sizes.tolist() == [3.0, math.inf, 0.5]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0123456, "0.0123"),
        (0.00009999, "0.000100"),
        (1.0, "1.00"),
        (13.894, "13.9"),
        (999.6, "1000"),
        (12345.0, "12300"),
        (1.5e7, "1.50e7"),
        (1e-9, "1.00e-9"),
        (0, "0"),
        (-0.5, "-0.500"),
        (math.nan, "–"),
        (None, "–"),
        (math.inf, "∞"),
        ("x", "x"),
    ],
)
def test_numbers_have_three_digits(value: object, text: str) -> None:
    assert number(value) == text


def test_infinite_error_reads_diverged() -> None:
    assert error_number(math.inf) == "diverged"


def test_synthetic_run_is_measured_as_it_was_made() -> None:
    entries = {(m.observer, m.phase): m for m in phase_metrics(synthetic_result(), synthetic_spec())}
    for observer, size in zip(OBSERVERS[1:], (0.02, 0.06, 0.14), strict=True):
        speed = entries[observer, "braking"].speed
        assert speed is not None
        assert_allclose(speed.max_abs, size, rtol=0.01)  # a 20 Hz sampling of a 0.33 Hz wave meets its top to 0.3 %
