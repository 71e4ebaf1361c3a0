"""The study that writes the table of docs/theses/tuning_the_train.md: its quick form runs and has its rows."""

import re
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[3] / "docs"

pytestmark = pytest.mark.compiler


def rows(text: str) -> list[list[str]]:
    """Cells of the lines of a table."""
    return [[cell.strip() for cell in line.strip("| ").split("|")] for line in text.splitlines() if line[:1] == "|"]


def test_quick_form_has_the_rows_of_the_page(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.syspath_prepend(str(DOCS / "studies"))
    import tuning_the_train as study

    monkeypatch.setattr(sys, "argv", ["tuning_the_train.py", "--quick", "--write"])
    page = study.PAGE.read_text(encoding="utf-8")
    study.main()
    assert study.PAGE.read_text(encoding="utf-8") == page  # what is quick is not written
    part = re.search(r"<!-- study: validated -->\n(.*?)<!-- end -->", page, re.DOTALL)
    assert part
    quick, shown = rows(capsys.readouterr().out), rows(part[1])
    assert [row[0] for row in quick] == [row[0] for row in shown]
    assert [[cell == "\N{EN DASH}" for cell in row] for row in quick] == [
        [cell == "\N{EN DASH}" for cell in row] for row in shown
    ]
    for measured, printed in zip(quick[2:], shown[2:], strict=True):
        assert 0.3 < float(measured[1]) / float(printed[1].split()[0]) < 3.0  # a minute with one seed, of 15 with six
