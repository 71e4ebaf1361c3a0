"""The end of a session: baselines are written or refused, and the terminal says what was found. Standard library and
pytest.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from cosim.errors import CosimError
from cosim.pytest_plugin import index_page, options, services
from cosim.pytest_plugin.records import Records, RegressionRecord, verdict

TITLE = "fmu baselines"
LINES = 6
"""Lines of a difference shown at the end; the failure itself shows all."""
_WRITTEN: pytest.StashKey[list[str]] = pytest.StashKey()
REFUSED: pytest.StashKey[str] = pytest.StashKey()
"""Why nothing was written, or an empty text."""


def write_baselines(session: pytest.Session, exitstatus: int) -> None:
    """Write staged baselines, in the controller only, if no test failed or it is forced.

    Args:
        session: of pytest. exitstatus: of the tests.
    """
    config = session.config
    if hasattr(config, "workerinput") or options.mode(config) != "update":
        return
    staged = [record for record in Records.of(config).all() if record.staged]
    ended = exitstatus in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED)
    why = "tests failed" if session.testsfailed else "" if ended else "the session did not come to its end"
    config.stash[REFUSED] = why if staged and not config.getoption("--fmu-baseline-force") else ""
    if config.stash[REFUSED] or not staged:
        return
    from cosim.baselines.baseline_files import write_texts  # noqa: PLC0415 - only where something is written

    faults = config.stash.setdefault(_WRITTEN, [])
    for record in staged:
        texts = {file.name: file.read_text(encoding="utf-8") for file in Path(record.staged).iterdir()}
        try:
            write_texts(texts, Path(record.baseline))
        except CosimError as error:
            faults.append(str(error))
    if faults:
        session.exitstatus = pytest.ExitCode.INTERNAL_ERROR


def report(terminal: pytest.TerminalReporter, config: pytest.Config) -> None:
    """The section at the end; nothing where the fixture was not used.

    Args:
        terminal: where the summary goes. config: of the session.
    """
    records = Records.of(config).all()
    if not records:
        return
    terminal.section(TITLE)
    terminal.write_line(verdict(records))
    for record in records:
        if record.status not in ("equal", "unchanged"):
            _write_record(terminal, record, config)
    if options.mode(config) == "update":
        _write_update(terminal, records, config)
    for line in [*services.leave(records), *index_page.written(records, config)]:
        terminal.write_line(line)


def _write_record(terminal: pytest.TerminalReporter, record: RegressionRecord, config: pytest.Config) -> None:
    terminal.write_line(f"{record.test}: {options.shown(Path(record.baseline), config)} {_verb(record)}")
    for line in record.lines[:LINES]:
        terminal.write_line(f"    {line}")
    if len(record.lines) > LINES:
        terminal.write_line(f"    and {len(record.lines) - LINES} more")
    for kind, path in record.files.items():
        terminal.write_line(f"    {kind}: {path}")


def _verb(record: RegressionRecord) -> str:
    verbs = {"differs": "differs", "missing": "does not exist", "error": "could not be checked"}
    return verbs.get(record.status, record.status)


def _write_update(terminal: pytest.TerminalReporter, records: list[RegressionRecord], config: pytest.Config) -> None:
    staged = [record for record in records if record.staged]
    for fault in config.stash.get(_WRITTEN, []):
        terminal.write_line(f"error: {fault}", red=True)
    if why := config.stash.get(REFUSED, ""):
        advice = "Make them pass" if why == "tests failed" else "Run them to the end"
        terminal.write_line(
            f"No baseline was written: {why} ({len(staged)} to be written). "
            f"{advice}, or write all the same with --fmu-baseline-force.",
            red=True,
        )
    elif staged:
        terminal.write_line(f"{len(staged)} written.")
    if unused := _unused(records, config):
        terminal.write_line("Not used by this run: " + ", ".join(options.shown(path, config) for path in unused))


def _unused(records: list[RegressionRecord], config: pytest.Config) -> list[Path]:
    """Baselines beside those in use that no test asked for; nothing where only some of the tests were chosen."""
    chosen = (
        config.getoption("keyword", "") or config.getoption("markexpr", "") or any("::" in str(a) for a in config.args)
    )
    refused = config.stash.get(REFUSED, "")
    if chosen or refused:
        return []
    used = {Path(record.baseline) for record in records}
    return sorted({path for folder in {path.parent for path in used} for path in folder.glob("*.json")} - used)
