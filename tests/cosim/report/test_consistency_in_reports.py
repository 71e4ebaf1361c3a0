"""Filters that tell covariances are judged: in warnings, tables, figures and measures of a run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cosim.evaluation.consistency import _true_value, filter_consistency
from cosim.evaluation.consistency_table import consistency_table
from cosim.evaluation.result_warnings import result_warnings
from cosim.evaluation.roles import estimation_error
from cosim.evaluation.spec import ReportSpec
from cosim.report.figures.consistency_figure import NeesPanel, NisPanel
from cosim.report.live.render import live_page
from cosim.report.page.run_page import run_page
from cosim.results.result import Result
from cosim.results.result_data import SignalInfo
from cosim.run.outcome import Outcome
from cosim.studies.measures import error_measures, measure_unit

COUNT = 2001
SPEC = ReportSpec(true_position="plant.position", observers=["kf"], labels={"kf": "Filter"})
COVARIANCE = np.array([[4.0, 1.0], [1.0, 9.0]])


def run(reported: float = 1.0, *, nis: bool = True, covariance: bool = True, held: int = 1) -> Result:
    """A filter whose errors have a covariance `reported` times as large as it reports, samples independent."""
    random = np.random.default_rng(0)
    errors = random.multivariate_normal(np.zeros(2), reported * COVARIANCE, COUNT)
    columns = {"plant.position": np.arange(COUNT, dtype=float), "plant.angle": np.zeros(COUNT)}
    columns |= {"kf.position": columns["plant.position"] + errors[:, 0], "kf.angle": errors[:, 1]}
    columns |= {"kf.position_std": np.full(COUNT, 2.0), "kf.angle_std": np.full(COUNT, 3.0)}
    if nis:
        samples = reported * random.chisquare(2.0, COUNT // held + 1)
        columns |= {"kf.nis": np.repeat(samples, held)[:COUNT]}
        columns |= {f"kf.innovation_{name}": np.zeros(COUNT) for name in ("position", "angle")}
        columns |= {"kf.innovation_covariance[1]": np.ones(COUNT), "kf.innovation_likelihood": np.zeros(COUNT)}
    if covariance:
        columns |= {f"kf.covariance[{i + 1}]": np.full(COUNT, v) for i, v in enumerate(COVARIANCE.ravel())}
    table = np.empty(COUNT, [("time", "f8"), *((name, "f8") for name in columns)])
    table["time"] = 0.1 * np.arange(COUNT)
    for name, values in columns.items():
        table[name] = values
    return Result(table, [])


def test_a_consistent_filter_is_said_to_be_one() -> None:
    found = filter_consistency(run(), SPEC)
    assert [entry.name for entry in found] == ["NIS", "NEES", "NEES of position", "NEES of angle"]
    assert [entry.found.degrees for entry in found] == [2.0, 2.0, 1.0, 1.0]
    assert {entry.found.verdict for entry in found} == {"consistent"}
    assert all(0.93 < entry.found.inside < 0.97 for entry in found)
    assert [w for w in result_warnings(run(), SPEC) if "confident" in w] == []


def test_one_that_trusts_itself_too_much_is_warned_of_once_with_what_to_do() -> None:
    (warning,) = [w for w in result_warnings(run(4.0), SPEC) if "confident" in w]
    assert warning.startswith("Filter is overconfident: its NIS is 7.")
    assert "Increase the covariance of the process noise" in warning
    (warning,) = [w for w in result_warnings(run(0.25), SPEC) if "confident" in w]
    assert "underconfident" in warning
    assert "Decrease" in warning


def test_errors_without_noise_are_not_evaluated() -> None:
    """A plant that moves as the filter expects: NEES is 0 and says nothing of the covariance; NIS still does."""
    assert [entry.kind for entry in filter_consistency(run(1e-7), SPEC)] == ["NIS"]
    assert not any("confident" in w for w in result_warnings(run(1e-7, nis=False), SPEC))
    (warning,) = [w for w in result_warnings(run(1e-3), SPEC) if "confident" in w]
    assert "adds no noise in this run looks alike" in warning


def test_small_innovations_beside_large_errors_do_not_lead_to_smaller_covariances() -> None:
    lasting = run(4.0)
    lasting.table["kf.nis"] /= 16.0
    (warning,) = [w for w in result_warnings(lasting, SPEC) if w.startswith("Filter")]
    assert "leaves out an error that lasts" in warning
    assert "give it a state, or increase the covariance of the process noise" in warning
    assert "Decrease" not in warning


def test_what_is_stated_decides_what_is_evaluated() -> None:
    """Without NIS and covariance single quantities are, and then they warn."""
    alone = run(4.0, nis=False, covariance=False)
    assert [e.kind for e in filter_consistency(alone, SPEC)] == ["error", "error"]
    assert "NEES of position" in next(w for w in result_warnings(alone, SPEC) if "confident" in w)
    assert filter_consistency(alone, replace(SPEC, true_position=None)) == []
    assert _true_value(alone, SPEC, "angle") is not None
    assert _true_value(alone, replace(SPEC, true_position=None, true_speed="plant.speed"), "angle") is not None


def test_a_held_nis_counts_once_a_sample_and_the_start_up_not_at_all() -> None:
    assert filter_consistency(run(held=5), SPEC)[0].found.samples == COUNT // 5
    late = filter_consistency(run(), replace(SPEC, evaluate_after=100.0))
    assert late[0].found.samples == COUNT // 2 + 1
    doubled = run()
    doubled = replace(doubled, table=np.repeat(doubled.table, 2))  # rows before and after events
    assert [e.found.samples for e in filter_consistency(doubled, SPEC)] == [COUNT - 1, COUNT, COUNT, COUNT]


def test_the_report_shows_it() -> None:
    result = run(4.0)
    page = live_page(run_page(result, SPEC))
    assert "Consistency of the filters" in page
    assert "overconfident" in page
    assert "NIS and NEES" in page
    assert NisPanel.available(result, SPEC)
    assert not NisPanel.available(run(nis=False), SPEC)
    assert NeesPanel.available(run(nis=False, covariance=False), SPEC)
    assert NisPanel.draw(result, SPEC).get_yscale() == "log"
    assert len(NeesPanel.draw(run(covariance=False), SPEC).lines) == 3  # the line at 1, and two quantities
    text = consistency_table(filter_consistency(result, SPEC), SPEC).text()
    heading, _, row = text.splitlines()[:3]
    assert heading.startswith("filter consistency  judged by")
    assert (heading[0] == " ", row[0] == " ") == (False, False)  # words begin at the left, numbers end at the right
    assert [line.partition(":")[0] for line in text.splitlines()[-4:]] == [
        "NIS",
        "NEES",
        "NEES of one quantity",
        "overconfident",
    ]
    assert consistency_table([], SPEC).text() == ""


def test_a_warning_says_what_its_words_mean() -> None:
    (by_nis,) = [w for w in result_warnings(run(0.25), SPEC) if "confident" in w]
    assert "; NIS: how far measurements are from what it expects, squared, over the variance" in by_nis
    (by_nees,) = [w for w in result_warnings(run(4.0, nis=False), SPEC) if "confident" in w]
    assert "; NEES: how far all its states are from the truth, squared, over the variances" in by_nees


def test_sweeps_have_measures_that_are_one_for_a_consistent_filter() -> None:
    measures = error_measures(Outcome(run(), SPEC, ()))
    assert abs(measures["kf.nis"] - 1.0) < 0.1
    assert abs(measures["kf.nees"] - 1.0) < 0.1
    assert abs(measures["kf.angle_nees"] - 1.0) < 0.1
    assert 0.93 < measures["kf.nis_inside"] < 0.97
    assert measure_unit("kf.nis") == "1"
    failed = error_measures(Outcome(replace(run(), failure="it broke"), SPEC, ()))
    assert np.isnan(failed["kf.nis"])


def test_the_share_in_the_legend_is_that_of_the_curve_that_is_drawn() -> None:
    def share(reported: float) -> float:
        (curve,) = [c for c in NisPanel.draw(run(reported), SPEC).get_lines() if "inside" in str(c.get_label())]
        return float(str(curve.get_label()).split(": ")[1].split(" %")[0])

    assert 90.0 < share(1.0) < 99.0
    assert share(2.0) < 5.0  # of single samples 84 % are


def test_the_speed_of_a_shaft_is_no_speed_of_a_train() -> None:
    table = run().table
    speeds = {unit: replace(SPEC, true_speed="plant.position") for unit in ("rad/s", "m/s", "km/h", "1")}
    for unit, spec in speeds.items():
        result = Result(table_with_speed(table), [SignalInfo("kf.speed", unit)])
        error = estimation_error(result, spec, "kf", "speed")
        assert (error is None) == (unit == "rad/s"), unit


def table_with_speed(table: np.ndarray) -> np.ndarray:
    """The table with a column more."""
    wider = np.zeros(len(table), [*table.dtype.descr, ("kf.speed", "f8")])
    for name in table.dtype.names or ():
        wider[name] = table[name]
    return wider
