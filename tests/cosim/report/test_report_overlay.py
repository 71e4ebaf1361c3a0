"""Several runs laid over each other: lines that can be told apart, differences to the first run, what differs, bad
input.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_hex
from synthetic_run import OBSERVERS, synthetic_result, synthetic_spec

from cosim.drawing.style import run_line
from cosim.errors import ComparisonError, OutputError
from cosim.evaluation.metrics import phase_metrics
from cosim.evaluation.spec import Phase, ReportSpec
from cosim.report.figures.overlay_figures import _error_overlay, _estimate_overlay, _signal_figure, _true_speed_figure
from cosim.report.live.render import live_page
from cosim.report.overlay.changing_signals import changing_signals
from cosim.report.overlay.overlaid_runs import MOST_RUNS, OverlayRun, make_runs
from cosim.report.overlay.overlay_measures import Measured, difference, measured, numbers_table
from cosim.report.page import overlay
from cosim.report.page.overlay import differences, layout_note, overlay_page, write_overlay, write_overlay_page
from cosim.results.result import Result
from fmus.tables.table import Column

SPEC = synthetic_spec()


def scaled(factor: float, observer: str = OBSERVERS[0], **summary: Any) -> Result:
    """The synthetic run with the speed error of one observer multiplied, and other entries in the summary."""
    result = synthetic_result(step=0.2)
    true = result["locomotive.speed"]
    result.table[f"{observer}.speed"] = true + factor * (result[f"{observer}.speed"] - true)
    return replace(result, summary={**result.summary, **summary})


def two(**summary: Any) -> list[OverlayRun]:
    return make_runs([scaled(1.0), scaled(2.0, **summary)], [SPEC, SPEC], ["before", "after"])


# --- runs -------------------------------------------------------------------------------------------------------------


def test_all_are_evaluated_by_the_phases_of_the_first() -> None:
    other = replace(SPEC, phases=[Phase("else", 0, 1)], evaluate_after=50.0)
    runs = make_runs([scaled(1.0), scaled(1.0)], [SPEC, other], ["a", "b"])
    assert (runs[1].spec.phases, runs[1].spec.evaluate_after) == (SPEC.phases, SPEC.evaluate_after)
    assert "b named other phases; all are judged over those of a." in live_page(overlay_page(runs))


def test_without_phases_one_phase_holds_all_runs() -> None:
    spec, short = replace(SPEC, phases=()), scaled(1.0)
    runs = make_runs([replace(short, table=short.table[:100]), scaled(1.0)], [spec, spec], ["a", "b"])
    assert runs[0].spec.phases == [Phase("whole run", 0.0, 90.0)]


@pytest.mark.parametrize(
    ("count", "labels", "message"),
    [
        (2, ["a"], "2 results, 2 roles and 1 labels"),
        (2, ["a", "a"], "label 'a'"),
        (0, [], "0 results"),
        (MOST_RUNS + 1, [str(i) for i in range(MOST_RUNS + 1)], "At most 12 runs"),
    ],
)
def test_runs_that_cannot_be_laid_over_each_other(count: int, labels: list[str], message: str) -> None:
    with pytest.raises(ComparisonError, match=message):
        make_runs([scaled(1.0)] * count, [SPEC] * count, labels)


def test_an_empty_run_is_named() -> None:
    empty = replace(scaled(1.0), table=scaled(1.0).table[:0], failure="it did not start")
    with pytest.raises(ComparisonError, match="b has no rows: it did not start"):
        make_runs([scaled(1.0), empty], [SPEC, SPEC], ["a", "b"])


def test_a_signal_with_two_units_is_named_and_no_difference_of_it_is_made() -> None:
    first = scaled(1.0)
    name = first.signals[0].name
    second = replace(first, signals=[replace(first.signals[0], unit="km"), *first.signals[1:]])
    verdict = overlay_page(make_runs([first, second], [SPEC, SPEC], ["a", "b"])).verdict
    assert f"{name} has several units, {first.signals[0].unit} in a, km in b: no difference" in verdict.text
    assert verdict.mood == "doubt"
    assert "several units" not in overlay_page(make_runs([first, first], [SPEC, SPEC], ["a", "b"])).verdict.text


# --- figures ----------------------------------------------------------------------------------------------------------


def test_runs_differ_in_colour_or_dashes_and_neighbours_in_both() -> None:
    lines = [run_line(i) for i in range(MOST_RUNS)]
    readings = [(to_hex(line["color"]), str(line["linestyle"])) for line in lines]
    assert len(set(readings)) == MOST_RUNS
    assert all(a[0] != b[0] and a[1] != b[1] for a, b in pairwise(readings))


def test_each_observer_has_a_panel_with_a_line_for_each_run() -> None:
    figure = _error_overlay(two(), "speed")
    assert figure is not None
    assert len(figure.axes) == len(OBSERVERS)
    for ax in figure.axes:
        lines = [line for line in ax.lines if line.get_label() in ("before", "after")]
        assert len(lines) == 2
        assert "[m/s]" in ax.get_ylabel()
    assert figure.axes[-1].get_xlabel() == "Time [s]"


def test_single_observers_share_a_panel_whatever_their_names() -> None:
    specs = [replace(SPEC, observers=[o]) for o in OBSERVERS[:2]]
    runs = make_runs([scaled(1.0), scaled(1.0)], specs, ["a", "b"])
    figure = _error_overlay(runs, "position")
    assert figure is not None
    assert len(figure.axes) == 1
    assert {row.observer for row in measured(runs)} == {"differentiator + CDO / Takagi-Sugeno CDO"}


def test_an_observer_of_one_run_only_has_a_panel() -> None:
    runs = make_runs(
        [scaled(1.0), scaled(1.0)],
        [replace(SPEC, observers=OBSERVERS[:2]), replace(SPEC, observers=OBSERVERS[1:])],
        ["a", "b"],
    )
    figure = _estimate_overlay(runs, "slip")
    assert figure is not None
    drawn = [{str(line.get_label()) for line in ax.lines} & {"a", "b"} for ax in figure.axes]
    assert drawn == [{"a"}, {"a", "b"}, {"b"}, {"b"}]


def test_what_no_run_has_is_no_figure() -> None:
    runs = make_runs([scaled(1.0)] * 2, [ReportSpec()] * 2, ["a", "b"])
    assert _true_speed_figure(runs) is _error_overlay(runs, "speed") is _estimate_overlay(runs, "slip") is None
    assert _signal_figure(runs, "no.such") is None


def test_signals_that_differ_most_are_drawn_where_nothing_has_a_role(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(overlay, "SIGNALS_SHOWN", 1)
    runs = make_runs([scaled(1.0), scaled(3.0)], [ReportSpec()] * 2, ["a", "b"])
    assert changing_signals(runs, 1) == ["differentiator_cdo.speed"]
    assert [panel.title for panel in overlay_page(runs).panels if panel.is_shown] == ["differentiator_cdo.speed"]


# --- numbers ----------------------------------------------------------------------------------------------------------


def test_differences_are_those_of_the_metrics_of_each_run() -> None:
    runs = two()
    rows = {(row.observer, row.phase): row.values for row in measured(runs)}
    alone = {m.phase: m for m in phase_metrics(runs[1].result, SPEC) if m.observer == OBSERVERS[0]}
    for phase, metrics in alone.items():
        before, after = (rows["differentiator + CDO", phase][name] for name in ("before", "after"))
        assert metrics.speed is not None
        assert after[:2] == (metrics.speed.max_abs, metrics.speed.rms)
        assert np.divide(after[:2], before[:2]) == pytest.approx([2.0, 2.0], rel=1e-9)  # the error was doubled
        assert after[2:] == before[2:]


@pytest.mark.parametrize(
    ("value", "first", "text"),
    [
        (3.0, 2.0, "+1.0 (+50.0 %)"),
        (1.0, 2.0, "−1.0 (−50.0 %)"),
        (2.0, 2.0, "same"),
        (2.0, 0.0, "+2.0"),
        (-1.0, -2.0, "+1.0 (+50.0 %)"),
        (math.inf, 2.0, "diverged"),
        (2.0, math.inf, "did not diverge"),
        (math.inf, math.inf, "same"),
        (3, 5, "−2 (−40.0 %)"),
    ],
)
def test_difference_in_words(value: float, first: float, text: str) -> None:
    assert difference(value, first) == text
    column, name = Column("size"), ("before", "after")
    rows = [Measured("o", "p", {name[0]: (first,), name[1]: (value,)})]
    assert numbers_table(two(), rows, [column]).cells[1][2] == f"{column.cell(value)}\n{text}"


def test_the_page_names_the_largest_change() -> None:
    text = live_page(overlay_page(two()))
    first, *others = (run.label for run in two())
    assert f"{first} is what the others are compared with: {', '.join(others)}." in text
    assert "Largest rise of rms speed error" in text
    assert '<dd class="value">+100 %</dd>' in text  # the error was doubled
    assert "Largest fall" not in text  # nothing fell


# --- what differs -----------------------------------------------------------------------------------------------------


def component(result: Result, index: int, **entries: Any) -> list[Mapping[str, Any]]:
    components = [dict(entry) for entry in result.summary["components"]]
    components[index] |= entries
    return components


def test_settings_that_differ_are_named_and_no_others() -> None:
    base = scaled(1.0)
    changed = component(base, 2, preset="repaired", parameters={"gain": 2.5}, guid="{1}")
    rows = differences(two(step=0.02, components=changed, versions={**base.summary["versions"], "fmpy": "9.9"}))
    assert rows == [
        ["step", "0.01", "0.02"],
        ["differentiator_cdo: preset", "–", "repaired"],
        ["differentiator_cdo: GUID", "–", "{1}"],
        ["differentiator_cdo.gain", "–", "2.5"],
        ["version of fmpy", "0.3.32", "9.9"],
    ]
    assert differences(two()) == []


def test_an_unusual_summary_differs_without_harm() -> None:
    odd = {
        "components": [1, {"name": None, "parameters": 3}],
        "versions": 2,
        "master": [],
        "step": "x",
        "connections": None,
    }
    assert all(len(row) == 3 for row in differences(two(**odd)))


def test_layouts_are_compared_by_place_or_instant() -> None:
    runs = two()
    assert "All runs pass the same balises" in layout_note(runs)
    moved = [replace(e, true_position=e.true_position + 1.0, stamp=e.stamp + 0.1) for e in runs[1].result.events]
    later = [replace(e, stamp=e.stamp + 0.1) for e in runs[1].result.events]
    for events, equal in ((moved, False), (later, True), (moved[1:], False), ((), False)):
        other = make_runs([runs[0].result, replace(runs[1].result, events=events)], [SPEC, SPEC], ["a", "b"])
        assert ("All runs pass" in layout_note(other)) is equal
    none = make_runs([replace(r.result, events=()) for r in runs], [SPEC, SPEC], ["a", "b"])
    assert layout_note(none) == ""


# --- files ------------------------------------------------------------------------------------------------------------


def test_figures_of_an_earlier_overlay_do_not_stay(tmp_path: Path) -> None:
    results = [scaled(1.0), scaled(2.0)]
    runs = make_runs(results, [ReportSpec()] * 2, ["a", "b"])
    page = tmp_path / "overlay.html"
    write_overlay_page(runs, page, ["driver.effort", "locomotive.speed"], figures=True)
    (tmp_path / "figures" / "of_mine.png").write_bytes(b"")
    path = write_overlay_page(runs, page, ["driver.effort"], figures=True)
    assert sorted(p.name for p in path.parent.rglob("*.png")) == ["of_mine.png", "overlay_signal_1.png"]


def test_a_place_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="Choose another place"):
        write_overlay([scaled(1.0)], [ReportSpec()], ["a"], tmp_path / "file")


def test_labels_are_escaped() -> None:
    evil = '<img src=x onerror="1">&\'"'
    runs = make_runs([scaled(1.0), scaled(2.0)], [SPEC, SPEC], [evil, "b"])
    assert "<img src=x" not in live_page(overlay_page(runs))
