"""A page over all tests of a session that have a baseline, with links to the pages of what differs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from urllib.parse import quote

import pytest

from cosim.pytest_plugin import options
from cosim.pytest_plugin.records import AS_BEFORE, HEADLINES, RegressionRecord, verdict
from fmus.tables.table import Table, name_column, text_column

NAME = "index.html"


def written(records: Sequence[RegressionRecord], config: pytest.Config) -> list[str]:
    """Write the page where something is not as before, or where a folder for pages was asked for.

    An older one is removed elsewhere: it would not speak of this session.

    Args:
        records: of the session. config: of the session.

    Returns:
        Lines for the terminal: where it is, or why it could not be written.
    """
    folder = options.artifacts_folder(config)
    if not (config.getoption("--fmu-artifacts") or any(record.files for record in records)):
        (folder / NAME).unlink(missing_ok=True)
        return []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / NAME).write_text(_page(records, folder, config.rootpath), encoding="utf-8")
    except Exception as error:  # what was found must be reported, whatever happens to the page over it
        return [f"The page of all tests could not be written: {error}"]
    return [f"all tests: {options.shown(folder / NAME, config)}"]


def _page(records: Sequence[RegressionRecord], folder: Path, root: Path) -> str:
    from cosim.report.live.live_page import LivePage, PageVerdict, Rows, Section  # noqa: PLC0415 - where a page is written
    from cosim.report.live.render import live_page  # noqa: PLC0415

    columns = (
        name_column("test", "Test"),
        text_column("status", "Outcome"),
        text_column("changed", "Changed in what was run"),
        text_column("common", "In common"),
        text_column("worst", "Worst signal"),
    )
    shown = sorted(records, key=lambda record: record.status in AS_BEFORE)
    rows = [[_name(r, records), r.status, *(r.headlines.get(key, "") for key in HEADLINES)] for r in shown]
    links = [_address(root / r.files["html"], folder) if "html" in r.files else None for r in shown]
    table = Table("tests", columns, rows, bad={"differs", "missing", "error"})
    sentence = PageVerdict(verdict(records), "good" if all(r.status in AS_BEFORE for r in records) else "bad")
    tests = Section("Tests", [Rows(table, links, plots=False)], is_open=True)
    return live_page(LivePage("FMU baselines", sentence, sections=[tests]))


def _address(page: Path, folder: Path) -> str:
    return quote(page.relative_to(folder).as_posix())


def _name(record: RegressionRecord, records: Sequence[RegressionRecord]) -> str:
    """The test, with the baseline where it has several."""
    several = sum(other.test == record.test for other in records) > 1
    return f"{record.test} ({Path(record.baseline).stem})" if several else record.test
