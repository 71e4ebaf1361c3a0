"""`fmus check` with FMUs that fork, eat memory, or write to the terminal, and with mistakes of its own."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from lying_fmus import build, description

from fmus.check import Class, Verdict, check_fmu, isolated
from fmus.check.check import REPEATED, Check
from fmus.check.checked_instance import FmuInstance
from fmus.check.context import Context
from fmus.check.findings import CheckOutcome, class_of, passed
from fmus.check.worker import findings
from fmus.cli import main
from fmus.plain import one_line, plain

pytestmark = pytest.mark.compiler
linux = pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="descendants are counted by /proc")


def marked_by(mark: Path) -> set[int]:
    """Processes with this mark in their environment, whoever their parents are."""
    found = set()
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            if str(mark) in (entry / "environ").read_text(errors="replace"):
                found.add(int(entry.name))
        except OSError:
            continue
    return found - {os.getpid()}


@pytest.fixture
def marked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A mark in the environment, which every process that is started from here on has too; none of them may be left."""
    monkeypatch.setenv("FMUS_CHECK_TEST", str(tmp_path))
    yield tmp_path
    left = marked_by(tmp_path)
    for number in left:
        os.kill(number, signal.SIGKILL)
    assert left == set()


@linux
@pytest.mark.parametrize("lie", ["FORKS", "FORKS_COPIES"])
def test_an_fmu_that_forks_in_each_step_is_stopped_and_nothing_is_left(lie: str, marked: Path) -> None:
    begin = time.monotonic()
    # fifty may be over before the processes are counted
    report = check_fmu(build(marked, lie), timeout=20.0, steps=100_000)
    finding = report.finding("stepping")
    assert finding.detail == f"started more than {isolated.PROCESSES} processes in 'stepping'", finding
    assert report.verdict is Class.DISTRUST
    assert time.monotonic() - begin < 60.0
    assert "Nothing: it could not be stepped." in report.trust


@linux
def test_what_it_leaves_running_is_reported_and_ended(marked: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Forked twice, in a session of its own: nothing a process group could reach."""
    monkeypatch.setattr(isolated, "PROCESSES", 1000)
    report = check_fmu(build(marked, "DAEMON"), timeout=20.0)
    finding = report.finding("processes")
    assert finding.verdict is Verdict.LIMIT
    assert "were left running, and ended here" in finding.detail
    assert report.finding("stepping").verdict is Verdict.PASS


@linux
def test_memory_is_bounded(marked: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(isolated, "MEMORY", 800 * 1024**2)
    report = check_fmu(build(marked, "EATS_MEMORY"), timeout=20.0, steps=1_000_000)
    assert report.finding("stepping").detail == "took more than 0.8 GB of memory in 'stepping'"
    assert report.verdict is Class.DISTRUST


def made(name: str, run: Callable[[Context], CheckOutcome], failing: Verdict, compares: bool = False) -> type[Check]:
    return type("Made", (Check,), {"name": name, "run": staticmethod(run), "failing": failing, "compares": compares})


@pytest.mark.parametrize("error", [KeyError("x"), TypeError("x"), ValueError("x"), AssertionError("x")])
def test_an_error_of_the_check_is_not_reported_of_the_fmu(error: Exception) -> None:
    def broken(_context: Context) -> CheckOutcome:
        raise error

    context = Context(Path(), None, 0.01, 0.0, {}, 1.0, 1)
    checks = [made("one", broken, Verdict.DISTRUST), made("two", lambda _: passed(), Verdict.LIMIT)]
    one, two = findings(checks, context)
    assert one.verdict is Verdict.ERROR
    assert "an error of this check, not of the FMU" in one.detail
    assert two.verdict is Verdict.PASS
    assert class_of([one, two]) is Class.LIMITS  # it was not seen, so it is not green


def test_a_wrong_call_of_ours_is_no_failure_of_the_fmu() -> None:
    def call() -> None:
        len(5)  # type: ignore[arg-type]

    with pytest.raises(TypeError):
        FmuInstance.guard(FmuInstance, "getReal", call)  # type: ignore[arg-type]


def test_where_equal_runs_differ_nothing_is_compared() -> None:
    context = Context(Path(), None, 0.01, 0.0, {}, 1.0, 1)
    differs = made(REPEATED, lambda _: CheckOutcome(None, "they differ"), Verdict.LIMIT)
    compared = made("compared", lambda _: passed(), Verdict.LIMIT, compares=True)
    assert [f.verdict for f in findings([differs, compared], context)] == [Verdict.LIMIT, Verdict.SKIPPED]


@pytest.mark.parametrize("arguments", [[], ["--json"]])
def test_escape_sequences_of_an_fmu_never_reach_the_terminal(
    arguments: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    xml = (
        description()
        .replace('modelName="liar"', 'modelName="li&#x9b;31mar&#x202e;"')
        .replace('"force"', '"fo&#x9b;2Jrce"')
    )
    path = build(tmp_path, "ESCAPES", xml=xml)
    assert main(["check", str(path), *arguments]) == 1
    assert main(["info", str(path)]) in (0, 1)
    assert main(["check", str(path), "--start", "none=1"]) == 2
    shown = capsys.readouterr()
    assert "owned" in shown.out
    assert [c for c in shown.out + shown.err if c in "\x1b\x07\x9b\u202e"] == []
    assert "\nforged" not in shown.out


def test_plain_text() -> None:
    assert plain("a\x1b[31m\x9b\u202eb\n\tµ é") == "a\\x1b[31m\\x9b\\u202eb\n\tµ é"
    assert one_line("a\n b\r\n\x1bc") == "a b \\x1bc"
