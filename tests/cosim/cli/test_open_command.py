"""`cosim open`: the page that is there, one that is made, none that can be."""

from __future__ import annotations

import os
import webbrowser
from pathlib import Path

import pytest
from synthetic_run import synthetic_result

from cosim.cli import main
from cosim.results.results_folder import REPORT, write_results


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Addresses that a browser was asked for."""
    found: list[str] = []
    monkeypatch.setattr(webbrowser, "open", lambda address: found.append(address) is None)
    return found


@pytest.fixture
def results(tmp_path: Path) -> Path:
    write_results(synthetic_result(step=1.0), tmp_path / "run", ("csv",))
    return tmp_path / "run"


@pytest.mark.parametrize("dates", [(0, 0), (2**31, 2**31)])
@pytest.mark.parametrize("name", ["table.csv", "summary.json", "events.csv"])
def test_a_page_is_made_once_and_again_when_the_results_are_others(
    results: Path, opened: list[str], name: str, dates: tuple[int, int]
) -> None:
    """Whatever the dates of the files: results that were copied over older ones keep theirs."""
    page = results / REPORT
    assert main(["open", str(results)]) == 0
    assert opened == [page.resolve().as_uri()]
    page.write_bytes(page.read_bytes().replace(b"live-data", b"kept"))
    for path in results.iterdir():
        os.utime(path, dates)
    assert main(["open", str(results)]) == 0
    assert "live-data" not in page.read_text(encoding="utf-8")  # the same results
    path = results / name
    path.write_text(path.read_text(encoding="utf-8").replace("0.0", "0.00", 1), encoding="utf-8")
    os.utime(path, (0, 0))
    assert main(["open", str(results)]) == 0
    assert "live-data" in page.read_text(encoding="utf-8")
    assert main(["open", str(page)]) == 0
    assert len(opened) == 4


def test_a_page_that_does_not_say_what_it_was_made_of_is_made_anew(results: Path, opened: list[str]) -> None:
    (results / REPORT).write_text("of a former version", encoding="utf-8")
    assert main(["open", str(results)]) == 0
    assert "live-data" in (results / REPORT).read_text(encoding="utf-8")
    assert len(opened) == 1


def test_a_table_and_a_place_that_is_named(results: Path, opened: list[str], tmp_path: Path) -> None:
    assert main(["open", str(results / "table.csv"), "--no-browser", "--out", str(tmp_path / "a.html")]) == 0
    assert "live-data" in (tmp_path / "a.html").read_text(encoding="utf-8")
    assert opened == []
    (tmp_path / "index.html").write_text("a sweep", encoding="utf-8")
    assert main(["open", str(tmp_path)]) == 0
    assert opened == [(tmp_path / "index.html").resolve().as_uri()]


def test_where_no_browser_opens_the_page_is_named(
    results: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(webbrowser, "open", lambda _address: False)
    assert main(["open", str(results)]) == 1
    shown = capsys.readouterr().out
    assert "open the page yourself" in shown
    assert REPORT in shown


def test_what_is_not_there_is_an_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["open", str(tmp_path / "none")]) == 2
    assert "Traceback" not in capsys.readouterr().err
