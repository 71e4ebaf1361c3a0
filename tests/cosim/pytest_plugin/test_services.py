"""What services of continuous integration get: properties in a JUnit file, a summary, remarks, a page of all tests."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lxml import html
from plugin_sessions import ONE, run, write

from cosim.pytest_plugin.records import RegressionRecord
from cosim.pytest_plugin.services import leave

pytest_plugins = ["pytester"]


def test_junit_summary_remarks_and_index_say_what_differs(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What a service of continuous integration reads holds the changes, what is common, and the worst signal."""
    write(pytester, ONE)
    write(pytester, ONE, name="test_other")
    run(pytester, "--fmu-baseline=update")
    write(pytester, ONE, 1.01)
    summary = pytester.path / "summary.md"
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(summary))
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    monkeypatch.setenv("GITHUB_WORKSPACE", str(pytester.path))
    checked = run(pytester, "--junitxml=junit.xml")
    checked.assert_outcomes(failed=1, passed=1)
    test = (pytester.path / "test_train.py").read_text(encoding="utf-8")
    line = 1 + next(k for k, text in enumerate(test.splitlines()) if "def test_line" in text)
    remark = f"::error file=test_train.py,line={line},title=fmu_regression%3A differs::both signals scale by +1 %25%0A*"
    checked.stdout.fnmatch_lines([remark, "all tests: .pytest_fmu*index.html"])

    properties = {
        (case.get("classname"), entry.get("name")): entry.get("value")
        for case in ElementTree.parse(pytester.path / "junit.xml").iter("testcase")
        for entry in case.iter("property")
    }
    assert properties["test_train", "fmu_status"] == "differs"
    assert properties["test_train", "fmu_common"] == "both signals scale by +1 %"
    assert properties["test_train", "fmu_worst"] == "train.position 1 % of its range"
    assert properties["test_train", "fmu_baseline"] == "test_line.json"
    assert properties["test_other", "fmu_status"] == "equal"

    text = summary.read_text(encoding="utf-8")
    assert text.startswith("### FMU baselines: 2 checked, 1 not as before\n")
    assert (
        "| test_train.py::test_line | differs |  | both signals scale by +1 % | train.position 1 % of its range |"
        in text
    )

    folder = pytester.path / ".pytest_fmu"
    page = html.fromstring((folder / "index.html").read_text(encoding="utf-8"))
    rows = [["".join(cell.itertext()).strip() for cell in row] for row in page.iter("tr")]
    assert [row[:2] for row in rows[1:]] == [
        ["test_train.py::test_line", "differs"],
        ["test_other.py::test_line", "equal"],
    ]
    (link,) = page.iter("a")
    assert (folder / link.get("href")).is_file()

    write(pytester, ONE)
    run(pytester).assert_outcomes(passed=2)
    assert not (folder / "index.html").exists()  # it would not speak of this session
    run(pytester, "--fmu-artifacts=kept").assert_outcomes(passed=2)
    assert (pytester.path / "kept" / "index.html").is_file()


@given(st.text(max_size=30), st.text(max_size=30))
def test_texts_of_others_break_no_summary_and_no_remark(name: str, cause: str) -> None:
    record = RegressionRecord(
        f"test.py::{name}", "b.json", "differs", headlines={"changed": cause}, file=f"/x/{name}.py"
    )
    with TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setenv("GITHUB_STEP_SUMMARY", str(Path(folder) / "summary.md"))
        list(leave([record]))
        _, _, head, _, row, *rest = (Path(folder) / "summary.md").read_bytes().decode().split("\n")
    assert (row.count("|"), head.count("|"), rest) == (6, 6, ["", ""])
    assert "<" not in row
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("GITHUB_ACTIONS", "true")
        patch.delenv("GITHUB_STEP_SUMMARY", raising=False)
        (remark,) = leave([record])
    place, _, _ = remark.removeprefix("::error ").partition("::")
    assert "\n" not in remark
    assert [part.partition("=")[0] for part in place.split(",")] == ["file", "line", "title"]


def test_a_summary_that_cannot_be_written_is_a_line_and_fails_nothing(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(pytester, ONE)
    run(pytester, "--fmu-baseline=update")
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(pytester.path / "none" / "summary.md"))
    checked = run(pytester)
    checked.assert_outcomes(passed=1)
    checked.stdout.fnmatch_lines(["The summary of the step could not be written to *: No such file or directory"])
