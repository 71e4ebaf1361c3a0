"""Pictures, page and data of a comparison: the worst first, everything named, nothing from outside, in a real
browser.
"""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hand_made_comparison import ALLOWED, crossing, curves, different, differing, equal, missing
from hypothesis import given, settings
from hypothesis import strategies as st

from cosim.comparison.compare import compare_results
from cosim.comparison.comparison import Comparison
from cosim.comparison.verdict import ComparisonFinding, Curves, EventComparison, SignalComparison
from cosim.drawing.style import new_figure
from cosim.errors import OutputError
from cosim.report.figures.comparison_figure import (
    _comparison_error_figure,
    _worst_window,
    comparison_figure,
    comparison_picture,
)
from cosim.report.live.render import live_page
from cosim.report.page.comparison import comparison_page, draw_pictures, write_comparison, write_page
from cosim.report.page.picture_files import write_numbered
from cosim.results.result import Result, SignalInfo

# -- pictures
# -----------------------------------------------------------------------------------------------------------


def test_axes_have_names_with_units_and_a_legend() -> None:
    whole, error = comparison_figure(differing()), _comparison_error_figure(differing())
    for ax, what in ((whole, "Value"), (error, "Error")):
        assert ax.get_xlabel() == "Time [s]"
        assert ax.get_ylabel() == f"{what} [m/s]"
    labels = whole.get_legend_handles_labels()[1]
    assert {"reference", "result", "tolerance tube", "outside"} <= set(labels)
    assert "allowed: 0.0100" in error.get_legend_handles_labels()[1]


def test_both_curves_are_drawn_as_they_are() -> None:
    drawn = curves()
    ax = comparison_figure(differing(drawn=drawn))
    lines = {line.get_label(): line for line in ax.get_lines()}
    np.testing.assert_array_equal(lines["reference"].get_ydata(), drawn.reference)
    np.testing.assert_array_equal(lines["result"].get_ydata(), drawn.result)


def test_the_tube_has_a_shape_for_each_piece() -> None:
    shapes = [
        path.vertices
        for c in comparison_figure(differing()).collections
        if c.get_label() == "tolerance tube"
        for path in c.get_paths()
    ]
    assert len(shapes) == 2
    spans = [(shape[:, 0].min(), shape[:, 0].max()) for shape in shapes]
    assert spans[0] == (0.0, 30.0)
    assert spans[1][0] > 30.0
    assert shapes[0][:, 1].min() == pytest.approx(-ALLOWED)


def test_the_axis_shows_the_error_and_its_band() -> None:
    for excess in (0.05, 0.001):
        low, high = _comparison_error_figure(differing(excess=excess)).get_ylim()
        assert low < -max(excess, ALLOWED) < max(excess, ALLOWED) < high


def test_one_wild_value_does_not_hide_the_reference() -> None:
    drawn = curves(excess=1e12)
    assert comparison_figure(differing(drawn=drawn)).get_ylim()[1] < 1e3


@pytest.mark.parametrize("at", [0.0, 21.0, 60.0])
def test_the_zoom_holds_the_worst_point(at: float) -> None:
    signal = replace(differing(), max_error_at=at, findings=[replace(differing().findings[0], time=at, end=at)])
    window = _worst_window(signal)
    assert window is not None
    assert 0.0 <= window[0] <= at <= window[1] <= 60.0
    assert 0.0 < window[1] - window[0] <= 0.31 * 60.0


def test_the_zoom_shows_a_shifted_jump_and_what_may_be_shifted() -> None:
    jump = ComparisonFinding("jump_time", 30.0, 30.0, 30.0, 30.4, 0.4, 0.2, "late")
    signal = replace(differing(), findings=[jump], max_error_at=float("nan"), allowed_time=0.5)
    window = _worst_window(signal)
    assert window is not None
    assert window[0] <= 30.0 - 4 * 0.5
    assert window[1] >= 30.0 + 4 * 0.5


@settings(max_examples=20)
@given(
    late=st.lists(st.sampled_from([0.05, 0.3, 0.6]), min_size=4, max_size=4).flatmap(
        lambda others: st.permutations([0.9, *others])
    )
)
def test_the_zoom_of_several_late_jumps_holds_the_latest(late: list[float]) -> None:
    time = np.round(np.arange(0.0, 60.0, 0.05), 9)
    begins = np.array([5.0, 15.0, 25.0, 35.0, 45.0])
    steps = [np.searchsorted(b, time, "right").astype(float) for b in (begins, begins + np.array(late))]
    table = [np.array(list(zip(time, v, strict=True)), [("time", float), ("a.b", float)]) for v in steps]
    results = [Result(rows, [SignalInfo("a.b", variability="discrete")]) for rows in table]
    (signal,) = compare_results(*results).signals
    window = _worst_window(signal)
    assert window is not None
    assert signal.findings[0].kind == "jump_time"
    latest = begins[int(np.argmax(late))]
    assert window[0] <= latest < latest + max(late) <= window[1]


def without_curves() -> SignalComparison:
    return replace(differing(), curves=None)


def test_without_curves_there_is_a_word_instead() -> None:
    ax = comparison_figure(without_curves())
    assert "no curves" in ax.texts[0].get_text()
    assert "no curves" in _comparison_error_figure(without_curves()).texts[0].get_text()
    assert _worst_window(without_curves()) is None


NOTHING = np.empty(0)
ODD = {
    "empty": Curves(*[NOTHING] * 9, 0.1),
    "one row": Curves(*[np.zeros(1)] * 9, 0.0),
    "not a number": replace(curves(), result=np.full(601, np.nan), error=np.full(601, np.nan)),
    "infinite": replace(curves(), result=np.full(601, np.inf), error=np.full(601, np.inf)),
    "huge": replace(curves(), reference=np.full(601, 1e300), lower=np.full(602, -1e308), upper=np.full(602, 1e308)),
    "no tube": replace(curves(), tube_time=NOTHING, lower=NOTHING, upper=NOTHING),
    "constant": replace(curves(), reference=np.zeros(601), result=np.zeros(601), error=np.zeros(601), allowed=0.0),
    "result ends early": replace(curves(), result_time=np.linspace(0.0, 30.0, 11), result=np.zeros(11)),
}


@pytest.mark.parametrize("drawn", ODD.values(), ids=ODD.keys())
def test_odd_curves_can_be_drawn(drawn: Curves) -> None:
    assert comparison_picture(differing(drawn=drawn), "png").startswith(b"\x89PNG")


def test_equal_pictures_are_equal_bytes() -> None:
    assert comparison_picture(differing(), "png") == comparison_picture(differing(), "png")


def test_long_runs_are_thinned() -> None:
    ax = comparison_figure(differing(drawn=curves(rows=200_001)))
    assert all(np.size(line.get_xdata()) < 10_000 for line in ax.get_lines())


def test_it_draws_on_axes_passed() -> None:
    ax = new_figure().add_subplot()
    assert comparison_figure(differing(), ax) is ax
    assert _comparison_error_figure(differing(), ax) is ax


# -- page
# ---------------------------------------------------------------------------------------------------------------


def page_of(comparison: Comparison) -> str:
    return live_page(comparison_page(comparison))


def test_the_page_says_what_differs_before_all_else() -> None:
    text = page_of(different())
    verdict, worst, table = (
        text.index("2 are not as in the reference"),
        text.index("at worst 0.05 m/s"),
        text.index("<table>"),
    )
    assert verdict < worst < table
    assert "nearest: train.slip_ratio" in text
    assert "telegram &#39;B7&#39;" in text
    assert "Other versions of fmpy." in text
    assert text.count("reference &lt;1&gt;") == 2  # title and heading
    assert "<1>" not in text


def test_the_page_of_equal_runs() -> None:
    text = page_of(equal())
    assert "Equal within tolerance: " in text
    assert "All 5 balise telegrams match." in text
    assert "<img" not in text
    assert "40 %" in text  # of the tolerance was used


def test_the_table_has_the_worst_first() -> None:
    signals = [crossing("a", 0.1), crossing("b", 0.9), differing("c"), missing("d")]
    text = page_of(Comparison("x", "y", signals))
    table = text[text.index('id="all-signals"') :]
    assert re.findall(r'<th scope="row">(\w)</th>', table) == ["d", "c", "b", "a"]
    assert table.count('class="bad"') == 2


def test_extra_signals_are_listed_and_fail_only_where_asked() -> None:
    extra = replace(missing("train.new"), status="extra", nearest=())
    for fails in (False, True):
        text = page_of(Comparison("x", "y", [crossing(), extra], extra_fails=fails))
        assert "train.new" in text
        assert ('class="bad">only in the result' in text) is fails


def test_pictures_are_those_of_the_worst_signals_and_not_too_many() -> None:
    sizes = {f"signal_{i}": 0.02 + 0.001 * i for i in range(3)}
    comparison = Comparison("x", "y", [differing(name, excess=size) for name, size in sizes.items()])
    comparison = replace(
        comparison,
        signals=[replace(s, findings=[replace(s.findings[0], size=sizes[s.name])]) for s in comparison.signals],
    )
    pictures = draw_pictures(comparison, most=1)
    assert list(pictures) == ["signal_2"]
    assert all(data.startswith(b"\x89PNG") for data in pictures.values())
    shown = [panel.title for panel in comparison_page(comparison).panels if panel.is_shown]
    assert shown == ["signal_2", "signal_2: error"]


def test_the_verdict_says_how_many_it_does_not_list() -> None:
    six, eight = (page_of(Comparison("x", "y", [differing(f"signal_{i}") for i in range(n)])) for n in (6, 8))
    assert "more, listed below" not in six
    assert "... and 2 more, listed below" in eight


def test_telegrams_that_were_not_compared_are_said_not_to_be() -> None:
    assert "one side keeps no telegrams" in page_of(replace(equal(), events=EventComparison(compared=False)))


# -- files
# --------------------------------------------------------------------------------------------------------------


def test_files_of_a_comparison(tmp_path: Path) -> None:
    paths = write_comparison(different(), tmp_path / "new" / "folder", pictures=True)
    assert set(paths) == {"html", "json", "png", "pictures"}
    assert paths["png"].read_bytes().startswith(b"\x89PNG")
    data = json.loads(paths["json"].read_text())
    assert data["equal"] is False
    assert [s["name"] for s in data["signals"]] == ["train.position", "train.speed", "train.slip"]
    assert data["signals"][2]["max_error"] is None  # NaN is no JSON
    assert sorted(p.name for p in paths["html"].parent.iterdir()) == [
        "comparison.html",
        "comparison.json",
        "comparison_pictures",
    ]


def test_pictures_of_an_earlier_comparison_go(tmp_path: Path) -> None:
    write_comparison(different(), tmp_path, pictures=True)
    paths = write_comparison(equal(), tmp_path)
    assert set(paths) == {"html", "json"}
    assert list((tmp_path / "comparison_pictures").iterdir()) == []


def test_names_of_signals_become_names_of_files(tmp_path: Path) -> None:
    wild = ["train.x[1]", "train.x(1)", 'é/../../b:"|*?' + "c" * 300]
    paths = write_numbered(draw_pictures(Comparison("x", "y", [differing(name) for name in wild])), tmp_path, "png")
    assert set(paths) == set(wild)
    assert len({p.name.lower() for p in paths.values()}) == len(wild)
    assert all(re.fullmatch(r"[\w.-]{1,100}", p.name, re.ASCII) and p.parent == tmp_path for p in paths.values())


def test_a_place_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="file"):
        write_numbered(draw_pictures(different()), tmp_path / "file", "png")
    with pytest.raises(OutputError, match="file"):
        write_comparison(equal(), tmp_path / "file")
    with pytest.raises(OutputError, match=r"page\.html"):
        write_page(equal(), tmp_path / "file" / "page.html")


@pytest.mark.browser
@pytest.mark.parametrize("comparison", [different(), equal()], ids=["different", "equal"])
def test_the_page_in_a_browser(comparison: Comparison, tmp_path: Path) -> None:
    import browser

    browser.check_page(write_comparison(comparison, tmp_path)["html"])
