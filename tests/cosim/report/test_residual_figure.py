"""The figure of residuals over thresholds: which runs have it, and what is drawn of them."""

from __future__ import annotations

import numpy as np

from cosim.evaluation.spec import ReportSpec
from cosim.report.figures.residual_figure import FLOOR, ResidualsPanel
from cosim.report.live.render import live_page
from cosim.report.page.run_page import run_page
from cosim.results.formats.format import bare
from cosim.results.result import Result

NAMES = ("time", "a.ratio_quiet", "a.ratio_two_wheels", "a.speed", "fault")


def run() -> Result:
    """Ten seconds; one of two residuals crosses its threshold while a fault acts."""
    table = np.zeros(11, dtype=[(name, float) for name in NAMES])
    table["time"], table["a.ratio_quiet"] = np.arange(11.0), 0.5
    table["fault"] = table["time"] > 5.0
    table["a.ratio_two_wheels"] = 3.0 * table["fault"]
    return Result.of(bare(table))


def test_residuals_that_cross_their_thresholds_are_named_and_none_is_below_the_floor() -> None:
    axes = ResidualsPanel.draw(run(), ReportSpec(observers=["a"], true_fault="fault"))
    named = [line.get_label() for line in axes.get_lines() if not str(line.get_label()).startswith("_")]
    assert named == ["two wheels", "threshold"]
    assert min(float(np.min(line.get_ydata())) for line in axes.get_lines()) == FLOOR


def test_a_run_without_such_outputs_has_no_figure() -> None:
    assert ResidualsPanel.available(run(), ReportSpec(observers=["a"]))
    assert not ResidualsPanel.available(run(), ReportSpec(observers=["b"]))
    assert not ResidualsPanel.available(run(), ReportSpec())


def test_a_run_without_a_train_has_no_table_of_its_errors() -> None:
    assert "speed error" not in live_page(run_page(run(), ReportSpec(observers=["a"])))
    assert "speed error" in live_page(run_page(run(), ReportSpec(observers=["a"], true_speed="a.speed")))
