"""Report figures, tables and page: labels with units, wild data, missing data, and a page that needs nothing from
outside.
"""

import math
import re
from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from synthetic_run import OBSERVERS, ZONES, synthetic_result, synthetic_spec

from cosim.drawing.style import new_figure, observer_line, png
from cosim.errors import OutputError
from cosim.evaluation.error_table import error_table
from cosim.evaluation.metrics import phase_metrics
from cosim.evaluation.spec import ReportSpec
from cosim.evaluation.stored_spec import spec_of
from cosim.report.figures.drawing import thin
from cosim.report.figures.gap_figure import GapErrorsPanel, GapsPanel, _certified_gaps, _sampling_gaps
from cosim.report.figures.main_picture import main_picture
from cosim.report.figures.other_trains_figure import OtherTrainsPanel
from cosim.report.figures.panel import Panel
from cosim.report.figures.panels import FIGURES, draw_all, panels
from cosim.report.figures.run_figures import AdhesionPanel, SlipPanel, SpeedPanel
from cosim.report.live.first_sentence import first_sentence
from cosim.report.live.render import live_page
from cosim.report.page.run_page import run_page, write_report
from cosim.results.result import Result
from cosim.results.results_folder import read_results, write_results
from cosim.run.outcome import Outcome

PANELS = [panel for panel in panels() if panel.available(synthetic_result(), synthetic_spec())]
VOID = {"meta", "img", "br", "hr", "link", "input"}


class Page(HTMLParser):
    """A strict reader: every element must be closed in order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data if self.open and self.open[-1] not in ("style", "script") else ""

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attrs for name, attrs in self.tags if name == tag]


def rows_of(result: Result, count: int) -> Result:
    return replace(result, table=result.table[:count])


@pytest.fixture(scope="module")
def result() -> Result:
    return synthetic_result()


# --- figures ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("panel", PANELS, ids=lambda p: p.name)
def test_axes_have_names_with_units(panel: type[Panel], result: Result) -> None:
    ax = panel.draw(result, synthetic_spec(), None)
    assert ax.get_xlabel() == ("Way since the last balise [m]" if panel is GapErrorsPanel else "Time [s]")
    assert re.search(r"\[(km/h|m/s|m|1|N|s)\]", ax.get_ylabel())
    assert ax.get_legend() is not None


@pytest.mark.parametrize("panel", PANELS, ids=lambda p: p.name)
def test_figures_draw_on_the_axes_passed(panel: type[Panel], result: Result) -> None:
    ax = new_figure().add_subplot()
    assert panel.draw(result, synthetic_spec(), ax) is ax


@pytest.mark.parametrize("panel", PANELS, ids=lambda p: p.name)
def test_figures_leave_matplotlib_as_it_was(panel: type[Panel], result: Result) -> None:
    with matplotlib.rc_context({"font.size": 17.0, "axes.grid": False}):
        before = dict(matplotlib.rcParams)
        png(panel.draw(result, synthetic_spec(), None).figure)
        assert dict(matplotlib.rcParams) == before


def test_legends_lie_above_the_curves_and_inside_the_picture(result: Result) -> None:
    for panel in PANELS:
        ax = panel.draw(result, synthetic_spec(), None)
        ax.figure.draw_without_rendering()  # type: ignore[union-attr]
        box, legend = ax.get_window_extent(), ax.get_legend().get_window_extent()  # type: ignore[union-attr]
        assert legend.y0 >= box.y1
        assert legend.x1 <= ax.figure.bbox.x1, panel.name
        assert box.width > 0.8 * ax.figure.bbox.width, panel.name  # nothing squashes the axes


def test_what_is_granted_is_a_line_across_the_figure_however_alike_the_gaps(result: Result) -> None:
    ax = GapErrorsPanel.draw(result, synthetic_spec(), None)
    granted = next(line for line in ax.get_lines() if str(line.get_label()).startswith("SUBSET-041"))
    way, error = (np.asarray(values, float) for values in granted.get_data())
    assert tuple(way[[0, -1]]) == pytest.approx(ax.get_xlim())
    assert error[-1] == pytest.approx(5.0 + 0.05 * way[-1])


def test_other_trains_of_a_run_are_drawn_beside_the_true_one(result: Result) -> None:
    spec = replace(
        synthetic_spec(), observers=[], other_trains=["discrete_uio"], labels={"discrete_uio": "a second train"}
    )
    assert not OtherTrainsPanel.available(result, synthetic_spec())
    assert OtherTrainsPanel.available(result, spec)
    ax = OtherTrainsPanel.draw(result, spec, None)
    apart = np.asarray(ax.get_lines()[-1].get_ydata(), float)
    assert apart[-1] == pytest.approx((result["discrete_uio.position"] - result["locomotive.position"])[-1])
    for figure in (ax, SpeedPanel.draw(result, spec, None)):
        assert "a second train" in figure.get_legend_handles_labels()[1]
    assert spec_of(replace(result, summary={"report": {**vars(spec), "phases": []}})).other_trains == ["discrete_uio"]


def test_estimates_lie_above_what_is_measured_noisy_ones_too(result: Result) -> None:
    table = result.table.copy()
    table["discrete_uio.speed"] += 0.2 * (-1.0) ** np.arange(len(table))
    ax = SpeedPanel.draw(replace(result, table=table), synthetic_spec(), None)
    height = {str(line.get_label()): line.get_zorder() for line in ax.get_lines()}
    estimates = {synthetic_spec().labels.get(name, name) for name in synthetic_spec().observers}
    assert estimates <= set(height)
    assert height["true"] < height["odometer"] < min(height[name] for name in estimates)


@pytest.mark.parametrize(
    ("shown", "unit", "factor"), [("km/h", "km/h", 3.6), (None, "m/s", 1.0), ("mixed", "m/s", 1.0)]
)
def test_a_picture_of_speeds_is_in_the_unit_of_all_of_them(
    shown: str | None, unit: str, factor: float, result: Result
) -> None:
    own = {"discrete_uio.speed": "mph"} if shown == "mixed" else {}
    signals = [
        replace(s, display_unit=own.get(s.name, None if shown == "mixed" else shown)) if s.unit == "m/s" else s
        for s in result.signals
    ]
    ax = SpeedPanel.draw(replace(result, signals=signals), synthetic_spec(), None)
    true = next(line for line in ax.get_lines() if line.get_label() == "true")
    assert ax.get_ylabel() == f"Speed [{unit}]"
    top = float(np.nanmax(np.asarray(true.get_ydata(), float)))
    assert top == pytest.approx(factor * result["locomotive.speed"].max(), rel=1e-9)


def limits(ax: Axes) -> tuple[float, float]:
    return ax.get_ylim()


@pytest.mark.parametrize("key", ["speed_error", "position_error"])
def test_diverged_observer_does_not_squash_the_others(key: str, result: Result) -> None:
    panel = next(p for p in PANELS if p.name == key)
    wild = synthetic_result(diverged="takagi_sugeno_cdo")
    normal, diverged = (panel.draw(r, synthetic_spec(), None) for r in (result, wild))
    assert limits(diverged)[1] <= 1.5 * limits(normal)[1]
    assert any("diverged" in text for text in diverged.get_legend_handles_labels()[1])


def test_diverged_observer_does_not_stretch_the_speed_axis(result: Result) -> None:
    speed = PANELS[0]
    normal, diverged = (
        speed.draw(r, synthetic_spec(), None) for r in (result, synthetic_result(diverged="multirate_cdo"))
    )
    assert limits(diverged) == pytest.approx(limits(normal), rel=0.05)  # the odd one out set nothing but its own noise
    assert not any("off scale" in text for text in normal.get_legend_handles_labels()[1])
    assert "two CDOs (off scale)" in diverged.get_legend_handles_labels()[1]


def test_similar_errors_are_drawn_with_their_sign(result: Result) -> None:
    spec = replace(synthetic_spec(), observers=OBSERVERS[2:])
    ax = PANELS[1].draw(result, spec, None)
    assert ax.get_yscale() == "linear"
    assert limits(ax)[0] == -limits(ax)[1]


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e300, 0.0, 5e-324])
def test_figures_stand_any_value(value: float) -> None:
    wild = synthetic_result()
    for name in wild.table.dtype.names or ():
        if name.startswith("discrete_uio"):
            wild.table[name] = value
    pictures = draw_all(wild, synthetic_spec())
    assert len(pictures) == len(PANELS)


def test_every_column_may_be_beyond_all_bounds() -> None:
    wild = synthetic_result()
    for name in (wild.table.dtype.names or ())[1:]:
        wild.table[name][5:] = np.where(np.arange(len(wild.table) - 5) % 2, 1e308, math.nan)
    assert len(draw_all(wild, synthetic_spec())) == len(PANELS)


def test_observers_differ_in_colour_and_in_dashes() -> None:
    lines = [observer_line(OBSERVERS, o) for o in OBSERVERS]
    assert (
        len({to_hex(line["color"]) for line in lines})
        == len({str(line["linestyle"]) for line in lines})
        == len(OBSERVERS)
    )


def test_more_observers_than_colours_are_still_drawn_differently() -> None:
    names = [f"observer_{i}" for i in range(12)]
    lines = [observer_line(names, name) for name in names]
    assert len({(to_hex(line["color"]), str(line["linestyle"])) for line in lines}) == len(names)
    colours = [to_hex(line["color"]) for line in lines]
    assert colours[:6] == colours[6:]


def test_a_locked_wheel_does_not_squash_the_slip_of_the_others() -> None:
    wild = synthetic_result()
    for observer in OBSERVERS:
        wild.table[f"{observer}.slip"][len(wild.table) // 2 :] = -43.0
    low, high = SlipPanel.draw(wild, replace(synthetic_spec(), true_slip=None)).get_ylim()
    assert -150.0 < low < high < 150.0


def test_a_force_that_does_not_change_is_drawn_without_an_offset() -> None:
    """Rounding of 1e-13 is no curve."""
    still = synthetic_result()
    for name in still.table.dtype.names or ():
        if name.endswith("adhesion_force"):
            still.table[name] = -0.8 + 1e-13 * np.sin(still.time)
    axes = AdhesionPanel.draw(still, synthetic_spec())
    low, high = axes.get_ylim()
    assert high - low > 1e-8
    png(axes.figure)
    assert axes.yaxis.get_offset_text().get_text() == ""


def test_equal_runs_give_equal_bytes(result: Result) -> None:
    assert png(main_picture(result, synthetic_spec())) == png(main_picture(result, synthetic_spec()))


def test_main_picture_shares_one_time_axis(result: Result) -> None:
    axes = main_picture(result, synthetic_spec()).axes
    assert len(axes) == 4
    assert {ax.get_xlim() for ax in axes} == {(0.0, 90.0)}


def test_thinning_keeps_the_extremes() -> None:
    time = np.arange(100_000.0)
    values = np.sin(time / 300)
    values[[3456, 78901]] = [50.0, -60.0]
    t, v = thin(time, values)
    assert len(t) < 7000
    assert (v.max(), v.min()) == (50.0, -60.0)
    assert (t[0], t[-1]) == (0.0, 99_999.0)
    assert np.all(np.diff(t) > 0)


def test_gaps_come_from_used_telegrams_only(result: Result) -> None:
    stamps, gaps = _sampling_gaps(result)
    used = [e.stamp for e in result.events if e.kind == "true"]
    assert stamps.tolist() == used
    assert gaps.tolist() == np.diff(used).tolist()


def test_observer_without_a_limit_has_no_level(result: Result) -> None:
    assert _certified_gaps(result, synthetic_spec()) == dict(zip(OBSERVERS[:3], (0.5, 0.286, 0.5), strict=True))


def test_certified_gaps_name_their_observers(result: Result) -> None:
    texts = GapsPanel.draw(result, synthetic_spec(), None).get_legend_handles_labels()[1]
    assert "certified to 0.286 s: Takagi-Sugeno CDO (exceeded)" in texts
    assert "certified to 0.500 s: differentiator + CDO, two CDOs (exceeded)" in texts


# --- table ------------------------------------------------------------------------------------------------------------


def test_text_table_is_aligned_and_shows_published_numbers(result: Result) -> None:
    lines = error_table(phase_metrics(result, synthetic_spec()), synthetic_spec()).text().splitlines()
    assert len({len(line) for line in lines}) == 1
    assert len(lines) == 2 + 4 * 3
    assert "max |v| [m/s]" in lines[0]
    braking = next(line for line in lines if line.startswith("Takagi-Sugeno CDO") and "braking" in line)
    assert braking.split()[-2:] == ["0.0250", "0.0225"]


# --- page -------------------------------------------------------------------------------------------------------------


def test_page_needs_nothing_from_outside(result: Result, tmp_path: Path) -> None:
    path = write_report(result, synthetic_spec(), tmp_path / "out")
    text = path.read_text(encoding="utf-8")
    own = re.sub(r"<script.*?</script>", "", text, flags=re.DOTALL)
    assert not re.search(r"https?:|//[a-z]|url\(|<link|@import|<img", own)
    assert "src=" not in re.sub(r"[^<]", "", own)
    assert [p.name for p in path.parent.iterdir()] == ["report.html"]


def test_figures_are_drawn_where_they_are_asked_for(result: Result, tmp_path: Path) -> None:
    folder = write_report(result, synthetic_spec(), tmp_path / "out", figures=True).parent / "figures"
    assert {p.stem for p in folder.iterdir()} == {panel.name for panel in PANELS}
    assert all(p.read_bytes().startswith(b"\x89PNG") for p in folder.iterdir())


def test_page_is_well_formed_and_says_what_was_run(result: Result) -> None:
    page = Page(live_page(run_page(result, synthetic_spec())))
    assert len(page.all("h1")) == 1
    assert all(attrs.get("scope") for attrs in page.all("th"))
    for words in (
        "Scenario adhesion_zones covers 90 s of simulated time in communication steps of 10.0 ms",
        "72.9 times as fast as real time",  # 90 s in 1.234 s
        "located by 'rollback': redone steps are bit-identical.",
        "gaps up to 1.1 s exceed the certified 0.286 s",
        "published max |speed error| [m/s]",
        "does not hold",
        "balises were missed",
        "locomotive.fmu",
        "agree in order of magnitude only",
    ):
        assert words in page.text
    assert "The run ended early" not in page.text


def test_every_text_is_escaped(result: Result) -> None:
    evil = '<img src=x onerror="1">&\'"'
    spec = replace(synthetic_spec(), title=evil, labels=dict.fromkeys(OBSERVERS, evil), notes=[evil])
    phases = [replace(p, name=evil) for p in spec.phases]
    summary = {
        "scenario": evil,
        "localisation": {"method": "m", "reason": evil},
        "description": evil,
        "warnings": [evil],
        "notes": evil,
        "versions": {evil: evil},
        "components": [{"name": evil, "kind": evil}],
        "certificates": {evil: {"explanation": evil}},
    }
    page = Page(live_page(run_page(replace(result, summary=summary, failure=evil), replace(spec, phases=phases))))
    assert "onerror" not in {name for _, attrs in page.tags for name in attrs}
    assert page.text.count(evil) >= 10


def test_failure_is_the_first_sentence(result: Result) -> None:
    failed = replace(rows_of(result, 300), failure="Component 'locomotive' at t = 10 s: stopped.")
    page = Page(live_page(run_page(failed, synthetic_spec())))
    first = next(attrs for tag, attrs in page.tags if "verdict" in (attrs.get("class") or ""))
    assert (first["class"], first["role"]) == ("verdict bad", "alert")
    assert "Component 'locomotive' at t = 10 s: stopped." in page.text


@pytest.mark.parametrize("rows", [0, 1, 2])
def test_report_of_hardly_any_rows(rows: int, result: Result, tmp_path: Path) -> None:
    few = replace(rows_of(result, rows), events=(), summary={}, failure="initialisation failed")
    Page(write_report(few, synthetic_spec(), tmp_path).read_text(encoding="utf-8"))
    png(main_picture(few, synthetic_spec()))


@pytest.mark.parametrize(
    "spec", [ReportSpec(), ReportSpec(observers=OBSERVERS), ReportSpec(true_speed="no.such", observers=["none"])]
)
def test_report_without_roles(spec: ReportSpec, result: Result, tmp_path: Path) -> None:
    page = Page(write_report(result, spec, tmp_path).read_text(encoding="utf-8"))
    assert "nothing is estimated in it" in page.text
    assert any(panel.is_shown for panel in run_page(result, spec).panels)
    png(main_picture(result, spec))


def test_report_of_an_unusual_summary(result: Result) -> None:
    summary = {
        "scenario": 3,
        "wall_seconds": 0,
        "step": "x",
        "warnings": None,
        "certificates": {"a": 1},
        "components": [1],
        "versions": 2,
    }
    Page(live_page(run_page(replace(result, summary=summary), synthetic_spec())))


def test_report_of_a_result_read_back_is_equal(result: Result, tmp_path: Path) -> None:
    write_results(result, tmp_path / "a", ("csv",))
    first = live_page(run_page(result, synthetic_spec()))
    second = live_page(run_page(read_results(tmp_path / "a"), synthetic_spec()))
    assert _without_order(first) == _without_order(second)


def _without_order(text: str) -> list[str]:
    return sorted(text.splitlines())  # the summary's keys are sorted in its file


def test_figures_of_an_earlier_run_do_not_stay(result: Result, tmp_path: Path) -> None:
    write_report(result, synthetic_spec(), tmp_path, figures=True)
    write_report(result, ReportSpec(), tmp_path, figures=True)
    assert [p.name for p in (tmp_path / "figures").iterdir()] == ["gaps.png"]
    Outcome(result, ReportSpec(), ("csv",)).write(tmp_path, report=False)
    assert list((tmp_path / "figures").iterdir()) == []
    assert not (tmp_path / "report.html").exists()


def test_folder_that_cannot_be_written_is_refused(result: Result, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="Choose another output folder"):
        write_report(rows_of(result, 2), synthetic_spec(), tmp_path / "file")


def test_zones_are_shaded(result: Result) -> None:
    draw: Callable[..., Axes] = PANELS[1].draw
    shaded = [
        p
        for p in draw(result, synthetic_spec(), None).patches
        if p.get_label() == "low adhesion" or p.get_zorder() == 0
    ]
    assert len(shaded) == len(ZONES)


def test_a_long_text_folds_behind_its_first_part_and_loses_no_word() -> None:
    text = "unstable at a gap of 1 s: the error grows; " + "certified up to 0.5 s, and so on. " * 10
    shown, rest = first_sentence(text)
    assert shown == "unstable at a gap of 1 s: the error grows"
    assert rest.count("certified up to 0.5 s") == 10
    assert first_sentence("short; and seen whole") == ("short; and seen whole", "")


def test_a_figure_that_fails_is_left_out(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    class BrokenPanel(Panel):
        name, title, caption = "test_broken", "Broken", "Nothing."

        @classmethod
        def available(cls, _result: Result, spec: ReportSpec) -> bool:
            return bool(spec.no_such_role)  # type: ignore[attr-defined]

        @classmethod
        def plot(cls, _result: Result, _spec: ReportSpec, _ax: Axes) -> None:
            raise AssertionError

    monkeypatch.setitem(FIGURES, "test_broken", BrokenPanel)
    drawn = draw_all(synthetic_result(), synthetic_spec())
    assert BrokenPanel not in drawn
    assert set(PANELS) <= set(drawn)
    assert "figure 'test_broken' is left out: AttributeError" in caplog.text


def test_a_figure_says_what_it_is() -> None:
    with pytest.raises(TypeError, match="the figure Untitled has no title and no caption"):
        type("Untitled", (Panel,), {"name": "untitled"})


def test_a_run_without_rows_is_not_called_complete() -> None:
    result = synthetic_result()
    verdict = run_page(replace(result, table=result.table[:0]), synthetic_spec()).verdict
    assert (verdict.mood, verdict.text.partition(":")[0]) == ("bad", "The run has no rows")
