"""What values show of themselves: one screen in a terminal and in a notebook, whatever they hold; figures, progress."""

from __future__ import annotations

import io
import sys
from html import escape
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_scenarios import small

import cosim
from cosim import studies
from cosim.errors import OutputError
from cosim.runs.run import Run
from fmus.cli.progress import ProgressBar, reported
from fmus.tables.table import SCREEN_LINES, SCREEN_ROWS, SCREEN_WIDTH, Table, name_column, text_column


class Cells(HTMLParser):
    """The texts of the cells of a piece of HTML, and its tags as they are opened and closed."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.cells: list[str] = []
        self.open: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        if tag == "br":
            self.cells[-1] += "\n"
            return
        self.open.append(tag)
        if tag in ("td", "th"):
            self.cells.append("")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] in ("td", "th"):
            self.cells[-1] += data


MARKUP = ["<b>bold</b>", "a<br>b", "&lt;", "</td>", "<!-- no -->", '"><script>x</script>']
TEXTS = st.sampled_from(MARKUP) | st.text(st.characters(exclude_categories=("Cs", "Cc")), max_size=12)


@given(st.lists(st.tuples(TEXTS, TEXTS), min_size=1, max_size=SCREEN_ROWS), TEXTS)
def test_html_shows_every_cell_as_it_is_whatever_stands_in_it(rows: list[tuple[str, str]], meaning: str) -> None:
    columns = [name_column("a", "<b>name</b>", meaning), text_column("b", "text", write=str)]
    table = Table("t", [columns[0], columns[1]], [[a or "x", b] for a, b in rows])
    cells = [cell for row in table.cells for cell in row]
    assert Cells(table._repr_html_()).cells == ["<b>name</b>", "text", *cells]


@given(st.integers(0, 60))
def test_a_table_shows_its_first_rows_and_how_many_more_there_are(count: int) -> None:
    table = Table("t", [name_column("a", "a")], [[str(k)] for k in range(count)])
    text = repr(table)
    assert len(text.splitlines()) <= SCREEN_LINES
    assert (f"... and {count - SCREEN_ROWS} more rows" in text) == (count > SCREEN_ROWS)
    assert len(Cells(table._repr_html_()).cells) == (1 + min(count, SCREEN_ROWS) if count else 0)


def fits(value: Any) -> str:
    """The text of a value, which is no more than a screen."""
    text = repr(value)
    assert len(text.splitlines()) <= SCREEN_LINES + 1
    assert max(map(len, text.splitlines())) <= SCREEN_WIDTH
    Cells(value._repr_html_())
    return text


@pytest.fixture(scope="module")
def outcome() -> cosim.Outcome:
    return small(title="A <small> run").run(warn=lambda _: None)


def test_a_scenario_shows_its_components_and_what_it_lacks() -> None:
    text = fits(small(title="Small"))
    assert text.startswith("Small: 0.0 to 0.5 s, steps of 0.01 s, 4 components, 3 connections, balises.")
    assert "takagi_sugeno_cdo" in text
    assert "Not ready to run: script: step: is missing" in fits(cosim.Scenario(stop=1.0))
    assert "at least one component" in fits(cosim.Scenario(stop=1.0, step=0.1))


def test_an_outcome_shows_how_the_run_ended_and_its_errors(outcome: cosim.Outcome) -> None:
    text = fits(outcome)
    assert text.startswith("A <small> run. observer is off by at most")
    assert "\nobserver  whole run" in text
    assert " ".join(text.split()).startswith(f"A <small> run. {outcome.verdict.text}")
    assert "&lt;small&gt;" in outcome._repr_html_()
    assert "rows from 0 to 0.5 s" in fits(outcome.result)


def test_an_outcome_without_observers_shows_its_signals() -> None:
    s = cosim.Scenario(stop=0.1, step=0.01).add("train", model="longitudinal_train", backend="block3")
    text = fits(s.run(warn=lambda _: None))
    assert "train.position" in text
    assert "smallest" in text


def test_errors_are_those_of_the_signals(outcome: cosim.Outcome) -> None:
    (row,) = outcome.errors().data()
    error = outcome["observer.speed"] - outcome["locomotive.speed"]
    assert row["max_speed_error"] == pytest.approx(np.abs(error).max(), rel=1e-12)
    assert fits(outcome.errors()).startswith("observer")


def test_an_outcome_is_a_mapping_of_its_columns(outcome: cosim.Outcome) -> None:
    names = list(outcome)
    assert names == list(outcome.keys()) == list(outcome.result.table.dtype.names)
    assert len(outcome) == len(names) == len(outcome.result)
    assert all(name in outcome and len(outcome[name]) == len(outcome.time) for name in names)
    assert "observer.sped" not in outcome
    np.testing.assert_array_equal(outcome.time, outcome["time"])
    frame = outcome.to_pandas(["observer.speed"])
    np.testing.assert_array_equal(frame["observer.speed"].to_numpy(), outcome["observer.speed"])


def test_signals_are_drawn_by_unit_and_a_notebook_shows_the_figure(outcome: cosim.Outcome) -> None:
    figure: Any = outcome.plot("*.speed", "locomotive.position")
    assert [ax.get_ylabel() for ax in figure.axes] == ["locomotive.position [m]", "[km/h]"]
    drawn = {line.get_label(): line for ax in figure.axes for line in ax.get_lines()}
    assert set(drawn) == {"locomotive.position", "locomotive.speed", "observer.speed"}
    np.testing.assert_allclose(drawn["observer.speed"].get_ydata(), 3.6 * outcome["observer.speed"], rtol=1e-14)
    assert figure._repr_png_().startswith(b"\x89PNG")
    with pytest.raises(OutputError, match=r"did you mean 'observer\.speed'"):
        outcome.plot("observer.sped")


def test_the_main_picture_is_drawn_where_nothing_is_named(outcome: cosim.Outcome) -> None:
    figure: Any = outcome.plot()
    assert figure._repr_png_().startswith(b"\x89PNG")
    assert any("Speed" in ax.get_ylabel() for ax in figure.axes)


def test_a_sweep_shows_how_many_runs_failed_and_between_what_measures_lie() -> None:
    study = small().vary({"observer.estimated_speed": [9.0, 10.0, 11.0]})
    assert fits(study).startswith("3 runs of script, varied: observer.estimated_speed.")
    sweep = study.run()
    assert fits(sweep[1]).startswith("Run 1: observer.estimated_speed = 10.")
    text = fits(sweep)
    assert text.startswith("3 runs; varied: observer.estimated_speed. observer.speed_error_max")
    largest = [run.measures["observer.speed_error_max"] for run in sweep.runs]
    assert f"in run {int(np.argmin(largest))} to" in text
    axes: Any = sweep.plot("observer.speed_error_max")
    assert axes._repr_png_().startswith(b"\x89PNG")


def test_a_page_is_written_and_opened(outcome: cosim.Outcome, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    page = outcome.open(tmp_path / "pages")
    assert opened == [page.as_uri()]
    assert "A &lt;small&gt; run" in page.read_text(encoding="utf-8")


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_script_sees_a_bar_unless_it_wants_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fmus.cli.progress._DELAY", 0.0)
    shown = Terminal()
    monkeypatch.setattr(sys, "stderr", shown)
    small().run(warn=lambda _: None)
    assert "s simulated" in shown.getvalue()
    for progress in (False, lambda _done, _all: None):
        monkeypatch.setattr(sys, "stderr", silent := Terminal())
        small().run(warn=lambda _: None, progress=progress)
        assert silent.getvalue() == ""


def test_a_run_among_many_shows_no_bar_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fmus.cli.progress._DELAY", 0.0)
    monkeypatch.setattr(sys, "stderr", shown := Terminal())
    Run(small()).do()
    assert shown.getvalue() == ""
    small().vary({"observer.estimated_speed": [9.0, 10.0]}).run()
    assert "/2 [" in shown.getvalue()
    assert "simulated" not in shown.getvalue()


def test_a_bar_waits_until_it_is_worth_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", shown := Terminal())
    with reported(None, "run") as report:
        assert isinstance(report, ProgressBar)
        report(1, 2)
    assert shown.getvalue().strip() == ""


@pytest.mark.parametrize("package", ["cosim", "fmus", "plant_models", "fmu_observer"])
def test_a_package_lists_what_it_offers(package: str) -> None:
    module = sys.modules[package]
    assert set(module.__all__) <= set(dir(module))


def test_values_show_their_curves_in_a_notebook(outcome: cosim.Outcome) -> None:
    """Nothing runs there, and it is small."""
    heavier = small().set("locomotive.mass", 95e3).run(warn=lambda _: None)
    sweep = small().vary({"observer.estimated_speed": [9.0, 10.0, 11.0]}).run()
    values: list[tuple[Any, int, list[str]]] = [
        (outcome, 2, ["Speed [km/h]", "Speed error [m/s]"]),
        (cosim.compare(outcome, heavier), 2, ["Error of "]),
        (sweep, 2, ["observer.estimated_speed [m/s]", "observer.speed_error_max [m/s]"]),
        (studies.seed_study(small(), range(3), None), 1, ["Maximal speed error, "]),
    ]
    for value, figures, titles in values:
        html = value._repr_html_()
        assert [title for title in titles if escape(title) not in html] == []
        assert html.count("<figure") == figures
        assert "<script" not in html
        assert len(html) < 200_000


def test_a_comparison_shows_its_verdict_and_the_signals_that_differ(outcome: cosim.Outcome) -> None:
    assert fits(cosim.compare(outcome, outcome)).startswith("result agrees with reference: ")
    other = small().set("locomotive.mass", 95e3).run(warn=lambda _: None)
    text = fits(cosim.compare(outcome, other))
    assert text.startswith("result DIFFERS from reference: ")
    assert "locomotive.speed" in text


def test_where_nobody_sees_a_bar_there_is_a_line_now_and_then(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 100.0
    monkeypatch.setattr("fmus.cli.progress_lines.monotonic", lambda: now)
    monkeypatch.setattr(sys, "stderr", shown := io.StringIO())
    bars = [ProgressBar("run"), ProgressBar("run", silent=True), ProgressBar("run", lines_after=0.0)]
    for seconds, done in ((0.0, 0), (14.0, 1), (16.0, 2), (31.0, 3), (45.0, 4), (47.0, 5)):
        now = 100.0 + seconds
        for bar in bars:
            bar(done, 9, "one by one")
    assert shown.getvalue().splitlines() == [
        "0 of 9 runs done after 0 s: one by one",
        "2 of 9 runs done after 16 s: one by one",
        "3 of 9 runs done after 31 s: one by one",
        "5 of 9 runs done after 47 s: one by one",
    ]
