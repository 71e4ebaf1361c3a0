"""What services of continuous integration show: a summary of the step, and remarks at the lines of tests.

GitLab and others read the JUnit file of pytest, whose properties hold the same. Standard library only.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from cosim.pytest_plugin.records import AS_BEFORE, HEADLINES, RegressionRecord

SUMMARY, ON_GITHUB, CHECKOUT = "GITHUB_STEP_SUMMARY", "GITHUB_ACTIONS", "GITHUB_WORKSPACE"
"""Variables of the environment: file of the summary, whether commands on lines are read, folder of the clone."""
MOST = 100
"""Rows of a summary; a service cuts it off at a megabyte."""
_HEAD = "| test | outcome | changed in what was run | in common | worst |\n|---|---|---|---|---|"


def leave(records: Sequence[RegressionRecord]) -> Iterator[str]:
    """Write the summary of the step where the service names its file.

    Args:
        records: of the session.

    Yields:
        Lines for the terminal: remarks that the service reads, and why the summary was not written.
    """
    if os.environ.get(ON_GITHUB) == "true":
        yield from map(_remark, _failed(records))
    if file := os.environ.get(SUMMARY):
        try:
            with Path(file).open("a", encoding="utf-8") as summary:
                summary.write(_step_summary(records))
        except OSError as error:
            yield f"The summary of the step could not be written to {file}: {error.strerror or error}"


def _failed(records: Sequence[RegressionRecord]) -> list[RegressionRecord]:
    return [record for record in records if record.status not in AS_BEFORE]


def _step_summary(records: Sequence[RegressionRecord]) -> str:
    """The session in Markdown: how many are as before, and a table of the others and of what was delivered anew.

    Args:
        records: of the session.
    """
    shown = [record for record in records if record.status not in AS_BEFORE or record.headlines]
    more = f"\n\nand {len(shown) - MOST} more" if len(shown) > MOST else ""
    head = f"### FMU baselines: {len(records)} checked, {len(_failed(records))} not as before\n\n"
    return head + ("\n".join([_HEAD, *map(_row, shown[:MOST])]) + more + "\n\n" if shown else "")


def _row(record: RegressionRecord) -> str:
    first = record.lines[0] if record.lines and record.status == "error" else ""
    stated: Mapping[str, str] = {"changed": first, **record.headlines}
    cells = [record.test, record.status, *(stated.get(name, "") for name in HEADLINES)]
    return f"| {' | '.join(map(_markdown, cells))} |"


def _markdown(text: str) -> str:
    """A text in a cell, whatever is in it."""
    for sign, shown in (("&", "&amp;"), ("<", "&lt;"), (">", "&gt;"), ("|", "&#124;"), ("`", "&#96;"), ("*", "&#42;")):
        text = text.replace(sign, shown)
    return " ".join(text.split())


def _remark(record: RegressionRecord) -> str:
    """A line that the service shows as an error at the line of the test."""
    root = Path(os.environ.get(CHECKOUT) or Path.cwd())
    path = Path(record.file)
    file = path.relative_to(root).as_posix() if path.is_relative_to(root) else path.as_posix()
    lines = [*record.headlines.values()] or record.lines[:3] or [record.status]
    place = f"file={_of_property(file)},line={record.line},title={_of_property('fmu_regression: ' + record.status)}"
    return f"::error {place}::{_of_message(chr(10).join(lines))}"


def _of_message(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _of_property(text: str) -> str:
    return _of_message(text).replace(":", "%3A").replace(",", "%2C")
