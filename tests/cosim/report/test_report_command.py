"""``cosim report``: a page made again, several results over each other, and what is said of mistakes."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
from small_scenarios import small

from cosim.cli import main
from cosim.cli.report_command import _guess
from cosim.cli.report_command import _labels as default_labels
from cosim.evaluation.spec import ReportSpec
from cosim.evaluation.stored_spec import spec_of
from cosim.results.load_result import load_result
from fmus.tables.plain_data import jsonable


def plain(spec: ReportSpec) -> Any:
    return jsonable(asdict(spec))


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two results folders, ``one`` with a report."""
    folder = tmp_path_factory.mktemp("runs")
    outcome = small(title="A run").run()
    outcome.write(folder / "one")
    assert plain(spec_of(load_result(folder / "one"))) == plain(outcome.spec)  # a folder tells its roles
    small(title="A run").set("odometer.sample_period", 0.05).run().write(folder / "two", report=False)
    return folder


def test_a_report_is_made_again(runs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = runs / "one" / "report.html"
    before = page.read_bytes()
    page.unlink()
    assert main(["report", str(runs / "one")]) == 0
    # the summary's keys are sorted in its file
    assert sorted(page.read_bytes().splitlines()) == sorted(before.splitlines())
    assert capsys.readouterr().out.strip() == f"report: {page}"


def test_a_page_is_in_si_where_that_is_asked_for(runs: Path, tmp_path: Path) -> None:
    pages = {}
    for name, more in (("own", []), ("si", ["--si"])):
        assert main(["report", str(runs / "one"), "--out", str(tmp_path / f"{name}.html"), *more]) == 0
        pages[name] = (tmp_path / f"{name}.html").read_text(encoding="utf-8").partition('id="live-data"')[2]
    assert '"shown": {"unit": "km/h"' in pages["own"] or '"shown":{"unit":"km/h"' in pages["own"]
    assert "km/h" not in pages["si"].partition("</script>")[0]


def test_several_over_each_other(runs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    arguments = [str(runs / "one"), str(runs / "two"), "--labels", "10 ms, 50 ms", "--signals", "driver.*"]
    assert main(["report", *arguments]) == 0
    text = (tmp_path / "overlay.html").read_text("utf-8")
    for words in (
        "A run: 2 runs",
        "10 ms is what the others are compared with: 50 ms.",
        "odometer.sample_period",
        '"title":"driver.effort"',
    ):
        assert words in text


def test_folders_of_one_name_are_distinguished() -> None:
    assert default_labels(None, [Path("/a/one"), Path("/b/two")]) == ["one", "two"]
    assert default_labels(None, [Path("/a/one"), Path("/b/one"), Path("/b/two")]) == ["a/one", "b/one", "b/two"]
    assert len(set(default_labels(None, [Path("/a/one"), Path("/a/one")]))) == 2


@pytest.mark.parametrize(
    ("roles", "text"),
    [
        ({}, "their names give no hint."),
        ({"true_speed": "train.speed"}, "guessed from their names: true_speed = train.speed."),
        ({"observers": ["a", "b"]}, "guessed from their names: observers = a, b."),
    ],
)
def test_what_was_guessed_is_reported_in_words(roles: dict[str, Any], text: str) -> None:
    assert _guess(ReportSpec(**{"observers": [], **roles})) == text


def test_an_older_folder_is_read_and_the_guess_is_reported(
    runs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("table.csv", "events.csv", "messages.csv"):
        (tmp_path / name).write_bytes((runs / "two" / name).read_bytes())
    content = json.loads((runs / "two" / "summary.json").read_text("utf-8"))
    del content["summary"]["report"]
    (tmp_path / "summary.json").write_text(json.dumps(content), "utf-8")
    page = tmp_path / "elsewhere" / "page.html"
    assert main(["report", str(tmp_path), "--out", str(page)]) == 0
    assert "guessed from their names: true_position = locomotive.position" in capsys.readouterr().err
    assert "Speed error" in page.read_text("utf-8")
    assert not (tmp_path / "report.html").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["{0}/none"], "There is no"),
        (["{0}"], "is not a results folder"),
        (["{0}/one/table.csv"], "say with --out FILE.html"),
        (["{0}/one", "--signals", "driver.*"], "--signals is for several runs"),
        (["{0}/one", "{0}/two", "--labels", "a"], "expected 2 texts"),
        (["{0}/one", "{0}/two", "--labels", "a,a"], "Two runs have the label 'a'"),
        (["{0}/one", "{0}/two", "--signals", "driver.efort"], "did you mean 'driver.effort'"),
        (["{0}/one", "{0}/two", "--signals", "*"], "a page opens with 16 of them"),
        (["{0}/one", "{0}/two", "--out", "{0}/one/table.csv/x.html"], "cannot be written"),
    ],
)
def test_mistakes_are_explained(
    arguments: list[str],
    message: str,
    runs: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["report", *(a.format(runs) for a in arguments)]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert "Traceback" not in error
    assert list(tmp_path.iterdir()) == []


def test_figures_are_drawn_for_one_run_and_for_several(runs: Path, tmp_path: Path) -> None:
    folder = runs / "one" / "figures"
    assert main(["report", str(runs / "one"), "--figures"]) == 0
    assert {path.suffix for path in folder.iterdir()} == {".png"}
    assert main(["report", str(runs / "one")]) == 0
    assert list(folder.iterdir()) == []
    both = [str(runs / "one"), str(runs / "two"), "--out", str(tmp_path / "both.html"), "--figures"]
    assert main(["report", *both]) == 0
    assert (tmp_path / "figures" / "overlay_speed.png").read_bytes().startswith(b"\x89PNG")
