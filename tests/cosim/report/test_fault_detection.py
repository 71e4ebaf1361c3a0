"""Fault detection in numbers: which detections belong to which faults, exact intervals, positions before balises."""

from __future__ import annotations

from dataclasses import replace
from math import inf, isnan
from typing import Any

import numpy as np
import pytest
import scipy.stats

from cosim.evaluation.fault_detection import (
    FaultDetection,
    _evaluated_detections,
    clopper_pearson,
    fault_detection,
    garwood,
    intervals,
    position_errors,
)
from cosim.evaluation.fault_table import fault_table
from cosim.evaluation.spec import ReportSpec
from cosim.report.figures.fault_figure import BoundsPanel, FaultsPanel
from cosim.results.result import BaliseRecord, Result
from cosim.run.outcome import Outcome
from cosim.studies.measures import _detection_measures, measure_unit

SPEC = ReportSpec(true_position="train.position", true_fault="wheel.active", observers=["o", "alone"])


def made(true: list[tuple[float, float]], reported: list[tuple[float, float]], stop: float = 100.0) -> Result:
    """A run at 10 m/s in rows 0.1 s apart; the observer `o` is 1 m behind, `alone` tells nothing and is 3 m ahead."""
    t = np.round(np.arange(0.0, stop + 0.05, 0.1), 9)
    t = np.sort(np.append(t, 50.0))  # a balise: two rows

    def on(spans: list[tuple[float, float]]) -> np.ndarray:
        return np.any([np.zeros(len(t), bool), *((t >= a) & (t < b) for a, b in spans)], axis=0).astype(float)

    columns: dict[str, Any] = {
        "time": t,
        "train.position": 10.0 * t,
        "wheel.active": on(true),
        "o.position": 10.0 * t - np.where(np.arange(len(t)) < np.searchsorted(t, 50.0) + 1, 1.0, 0.0),
        "o.odometer_fault": on(reported),
        "alone.position": 10.0 * t + 3.0,
    }
    table = np.zeros(len(t), [(name, "f8") for name in columns])
    for name, values in columns.items():
        table[name] = values
    return Result(table, [], [BaliseRecord(50.0, 50.0, "b", 500.0, 500.0)])


def cells(found: FaultDetection, limit: float | None = None) -> dict[str, str]:
    """The row of an observer by the headings of a page."""
    table = fault_table([found], replace(SPEC, delay_limit=limit))
    return dict(zip((column.title() for column in table.columns), table.cells[0], strict=True))


def test_faults_misses_false_alarms_and_delays() -> None:
    true = [(10.0, 13.0), (20.0, 20.2), (30.0, 31.0)]
    reported = [(10.4, 13.2), (20.5, 21.0), (60.0, 61.0)]  # late by 0.4 s; just after a short one; of no fault
    result = made(true, reported)
    (found, alone) = fault_detection(result, SPEC)
    assert (found.faults, found.detected, found.missed, found.detections, found.false) == (3, 2, 1, 3, 1)
    np.testing.assert_allclose(found.start_delays, [0.4, 0.5], atol=1e-9)
    np.testing.assert_allclose(found.end_delays, [0.2, 0.8], atol=1e-9)
    assert found.time_outside == pytest.approx(0.2 + 0.5 + 1.0)
    assert (found.detection_rate, found.missed_rate, found.false_rate) == (2 / 3, 1 / 3, 1 / 3)
    assert found.false_per_hour == pytest.approx(36.0)
    assert found.position_errors == (pytest.approx(-1.0),)  # the row before the balise, not the one after
    assert not alone.indicates
    assert alone.position_errors == (pytest.approx(3.0),)
    shown = cells(found)
    assert (shown["Faults"], shown["Missed"], shown["False"]) == ("3", "1", "1")
    assert shown["Delay at start [s]"] == "0.450"
    assert cells(found, 1.0)["Delay at start [s]"] == "0.450 (not within 1.00)"
    assert "(within 0.500)" in cells(replace(found, faults=2), 0.5)["Delay at start [s]"]  # none missed, none later
    assert "(not within 0.499)" in cells(replace(found, faults=2), 0.499)["Delay at start [s]"]
    assert fault_detection(result, replace(SPEC, detection="position"))[0].detected == 0  # on before all of them
    text = fault_table([found, alone], SPEC).text()
    assert len(text.splitlines()) == 4
    nowhere = [replace(one, position_errors=()) for one in (found, alone)]
    left = fault_table(nowhere, SPEC).text()  # a turbine has no position
    assert ("mean |p|" in text, "mean |p|" in left, "outside [s]" in left) == (True, False, True)


def test_a_detection_that_never_ends_is_reported_so() -> None:
    (found, _) = fault_detection(made([(10.0, 12.0)], [(10.2, 200.0)]), SPEC)
    assert found.end_delays == (inf,)
    assert found.to_data()["end_delays"] == [None]
    assert cells(found)["Delay at end [s]"] == "not ended"


def test_a_detection_is_of_the_fault_in_which_it_begins() -> None:
    """What was on before a fault says nothing of it; two detections may be of one fault."""
    assert _evaluated_detections([(1.0, 2.0), (3.0, 4.0)], [(1.5, 4.5)], 10.0) == ([0.5], [2.5], 0)
    assert _evaluated_detections([(3.0, 4.0)], [(1.5, 4.5)], 10.0) == ([], [], 1)
    assert _evaluated_detections([(1.0, 5.0)], [(1.2, 2.0), (3.0, 5.1)], 10.0) == (
        [pytest.approx(0.2)],
        [pytest.approx(0.1)],
        0,
    )
    assert _evaluated_detections([], [(1.0, 2.0)], 10.0) == ([], [], 1)


@pytest.mark.parametrize(("limit", "reported"), [(None, 1), (0.7, 1), (0.3, 0)])
def test_a_detection_that_is_late_is_a_miss_and_no_false_alarm(limit: float | None, reported: int) -> None:
    starts, ends, false = _evaluated_detections([(1.0, 5.0)], [(1.6, 5.0)], 10.0, delay_limit=limit)
    assert (len(starts), len(ends), false) == (reported, reported, 0)
    (found, _) = fault_detection(made([(1.0, 5.0)], [(1.6, 5.0)]), replace(SPEC, delay_limit=limit))
    assert (found.detected, found.missed, found.false) == (reported, 1 - reported, 0)


def test_what_is_before_the_evaluation_does_not_count() -> None:
    (found, _) = fault_detection(made([(2.0, 3.0)], [(2.0, 3.0), (4.0, 5.0)]), replace(SPEC, evaluate_after=6.0))
    assert (found.faults, found.detections, found.false, found.duration) == (0, 0, 0, pytest.approx(94.0))
    assert isnan(found.missed_rate)


def test_without_the_role_or_a_run_nothing_is_evaluated() -> None:
    assert fault_detection(made([], []), ReportSpec(observers=["o"])) == []
    assert fault_detection(Result(np.zeros(0, [("time", "f8"), ("wheel.active", "f8")]), []), SPEC) == []
    assert position_errors(made([], []), ReportSpec(observers=["o"]), "o") == []


def test_rows_of_one_time_do_not_cut_an_interval() -> None:
    t = np.array([0.0, 1.0, 1.0, 2.0, 3.0])
    assert intervals(t, np.array([1.0, 1.0, 0.0, 1.0, 0.0])) == [(0.0, 1.0), (2.0, 3.0)]
    assert intervals(t, np.array([0.0, 1.0, 1.0, 1.0, 1.0])) == [(1.0, 3.0)]


@pytest.mark.parametrize(("count", "exposure"), [(0, 2.0), (1, 0.5), (7, 3.0), (120, 10.0)])
def test_garwood_is_the_exact_poisson_interval(count: int, exposure: float) -> None:
    """Against the definition: at the limits the tails of the Poisson distribution are 2.5 %."""
    low, high = garwood(count, exposure)
    assert scipy.stats.poisson.cdf(count, high * exposure) == pytest.approx(0.025)
    if count:
        assert scipy.stats.poisson.sf(count - 1, low * exposure) == pytest.approx(0.025)
    else:
        assert low == 0.0


@pytest.mark.parametrize(("count", "trials"), [(0, 5), (5, 5), (3, 40), (1, 1000)])
def test_clopper_pearson_is_that_of_scipy(count: int, trials: int) -> None:
    expected = scipy.stats.binomtest(count, trials).proportion_ci(method="exact")
    assert clopper_pearson(count, trials) == pytest.approx((expected.low, expected.high), abs=1e-9)
    assert all(map(isnan, clopper_pearson(0, 0)))
    assert all(map(isnan, garwood(0, 0.0)))


def test_they_are_measures_of_a_sweep() -> None:
    measures = _detection_measures(Outcome(made([(10.0, 13.0)], [(10.4, 13.2)]), SPEC))
    assert measures["o.missed_faults"] == measures["o.false_alarms"] == 0.0
    assert measures["o.detection_delay"] == pytest.approx(0.4)
    assert measures["alone.balise_error"] == pytest.approx(3.0)
    assert "alone.missed_faults" not in measures
    assert (measure_unit("o.detection_delay"), measure_unit("o.missed_faults")) == ("s", "1")


def test_figure_of_faults_has_a_row_for_the_truth_and_one_for_each_observer_that_reports() -> None:
    result = made([(10.0, 13.0)], [(10.4, 13.2), (60.0, 61.0)])
    assert FaultsPanel.available(result, SPEC)
    assert not FaultsPanel.available(result, replace(SPEC, true_fault=None))
    axes = FaultsPanel.draw(result, replace(SPEC, labels={"o": "Ours"}), None)
    assert [text.get_text() for text in axes.get_yticklabels()] == ["fault acts", "Ours"]
    truth, reported = (path.get_paths() for path in axes.collections)
    assert [(p.vertices[:, 0].min(), p.vertices[:, 0].max()) for p in truth] == [(10.0, 13.0)]
    assert [(p.vertices[:, 0].min(), p.vertices[:, 0].max()) for p in reported] == [(10.4, 13.2), (60.0, 61.0)]
    assert axes.get_xlabel() == "Time [s]"


def test_figure_of_bounds_holds_the_share_of_observers_that_report_one() -> None:
    t = np.arange(0.0, 10.0, 0.5)
    names = ("time", "train.speed", "o.speed", "o.error_bound", "alone.speed")
    table = np.zeros(len(t), [(name, "f8") for name in names])
    table["time"], table["train.speed"], table["alone.speed"] = t, 10.0, 99.0
    table["o.speed"], table["o.error_bound"] = 10.0 - 0.1 * t, 0.2
    result, spec = Result(table, [], []), replace(SPEC, true_speed="train.speed", labels={"o": "Ours"})
    assert BoundsPanel.available(result, spec)
    assert not BoundsPanel.available(result, SPEC)
    axes = BoundsPanel.draw(result, spec, None)
    curves = {str(line.get_label()): np.asarray(line.get_ydata(), float) for line in axes.get_lines()}
    assert set(curves) == {"Ours", "bound"}
    np.testing.assert_allclose(curves["Ours"], 0.5 * t, atol=1e-12)
    assert set(curves["bound"]) == {1.0}
    assert axes.get_ylim() == pytest.approx((1e-3, 1.5 * 4.75))
    assert axes.get_ylabel() == "|Speed error| / bound [1]"
    table["o.error_bound"][4], table["o.speed"][6] = 0.0, np.nan  # a bound of nothing, an estimate that is none
    curves = {str(line.get_label()): line.get_ydata() for line in BoundsPanel.draw(result, spec, None).get_lines()}
    assert np.isfinite(np.asarray(curves["Ours"], float)).all()
    assert min(curves["Ours"][4], curves["Ours"][6]) > 1e100
