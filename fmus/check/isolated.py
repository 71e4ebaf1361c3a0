"""Isolation: checks run in a child process with a time limit, so that an FMU that crashes, hangs or prints takes
nothing down.

A child costs about half a second to start. One that dies or stays silent costs the check it was in; another child does
the rest.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory, TemporaryFile
from time import monotonic
from typing import IO, Any

from fmus.check.check import END
from fmus.check.findings import CheckFinding, Verdict
from fmus.check.job import CheckJob
from fmus.check.known_checks import CHECKS
from fmus.check.worker import FILES_CLOSED, unrun
from fmus.isolation.crashes import note_crash
from plant_models.left_behind import owned

_START_LIMIT = 60.0
"""Time a child may take to start before its first check [s]; a loaded machine takes seconds."""

GRACE = 10.0
"""Time the watchdog of a child may take to end all that it watches [s]."""

PROCESSES = 32
"""Processes that an FMU may have running at once."""

MEMORY = 4 * 1024**3
"""Memory that an FMU, its processes and Python may take together [bytes]."""

_END_ADVICE = (
    "give each run a process of its own: cosim run writes its results before it ends the FMU, and waits for that as "
    "long as master.call_timeout says"
)
_WATCHDOG_ENDED = "ended, and its watchdog with it,"
_FROM_OUTSIDE = (_WATCHDOG_ENDED, "crashed with signal 9 ", "crashed with signal 15 ")
LEFT = "processes"
_CONSOLE = "console output"
SHOWN = 80
_PACKAGE_ROOT = Path(__file__).resolve().parents[2]


@dataclass
class _Child:
    """What came of one child process.

    Args:
        findings: what it reported. current: the check it was in when it ended, empty where it did all. end: how it
            ended, in words.
        crashed: whether it ended by itself or had to be stopped for what it took; not where it was silent.
        left: processes that it left running.
        ending: the call that was ending an instance, empty where none was. only_once: no other instance may be made.
    """

    findings: list[CheckFinding] = field(default_factory=list)
    current: str = ""
    end: str = ""
    crashed: bool = True
    left: int = 0
    ending: str = ""
    only_once: bool = False

    @property
    def where(self) -> str:
        """How it ended and in which call, where that is known."""
        return f"{self.end} in {self.ending}" if self.ending else self.end


def run_isolated(job: CheckJob, progress: Callable[[str], None] = lambda _: None) -> list[CheckFinding]:
    """Run a job in child processes.

    Args:
        job: which checks of which unpacked FMU; its budget is the time limit of each check.
        progress: is called with the name of each check that begins.

    Returns:
        A finding for each check of the job, and those about what the FMU left running and what it printed.
    """
    found: list[CheckFinding] = []
    left, running = job.checks, 0
    with TemporaryFile() as console:
        while left:
            child = _run_child(replace(job, checks=left), console, progress)
            found += child.findings
            running += child.left
            left = tuple(name for name in left if name not in {f.check for f in found})
            if not left:
                break
            lost = child.current or left[0]
            _remember(job, child, lost)
            if child.ending and job.ends and not child.only_once:
                found = [*_others(found), CheckFinding(END, Verdict.LIMIT, child.where, _END_ADVICE)]
                left, job = tuple(name for name in left if name != END), replace(job, ends=False)
                continue  # the check itself is made anew, with instances that are left as they are
            check = CHECKS[lost]
            found.append(check.lost(f"{child.where} in '{lost}'", crashed=child.crashed))
            left = tuple(name for name in left if name != lost)
            if check.basis:
                found += [unrun(name, lost) for name in left]
                left = ()
        found += [_left(running), _console(console)]
    order = {name: place for place, name in enumerate(job.checks)}
    return sorted(found, key=lambda f: order.get(f.check, len(order)))


def _remember(job: CheckJob, child: _Child, lost: str) -> None:
    """The FMU is remembered as one that ended a process, where that was not perhaps somebody else."""
    if child.crashed and not child.end.startswith(_FROM_OUTSIDE):
        note_crash(job.digest, f"{child.where} in the check '{lost}'")


def _others(findings: list[CheckFinding]) -> list[CheckFinding]:
    return [finding for finding in findings if finding.check != END]


def _run_child(job: CheckJob, console: IO[bytes], progress: Callable[[str], None]) -> _Child:
    seen = _Child()
    with _process(console) as process:
        lines = _reader(process)
        assert process.stdin is not None
        with suppress(OSError):  # a child that died at once is seen below
            process.stdin.write((job.to_json() + "\n").encode())
            process.stdin.close()
        limit, since = _START_LIMIT, monotonic()
        while True:
            try:
                line = lines.get(timeout=max(since + limit - monotonic(), 0.0))
            except queue.Empty:
                seen.end, seen.crashed = f"no answer within {limit:g} s", False
                break
            message = _parsed(line)
            if line is None or "left" in message:
                seen.end, seen.left = _ending(message), int(message.get("left", 0))
                break
            if "ending" in message:
                seen.ending, seen.only_once = str(message["ending"]), bool(message["only_once"])
                continue
            since = monotonic()
            if "start" in message:
                seen.current, limit = str(message["start"]), job.budget
                progress(seen.current)
            elif "finding" in message:
                seen.findings.append(CheckFinding.from_dict(message["finding"]))
                seen.current, limit = "", _START_LIMIT
    return seen


@contextmanager
def _process(console: IO[bytes]) -> Iterator[subprocess.Popen[bytes]]:
    """A child in a folder and a session of its own; it and what it started are ended here."""
    with TemporaryDirectory(prefix=owned("fmus-check-"), ignore_cleanup_errors=True) as folder:
        paths = [str(_PACKAGE_ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
        process = subprocess.Popen(
            [sys.executable, "-P", "-m", "fmus.check.watchdog", str(PROCESSES), str(MEMORY)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=console,
            cwd=folder,
            start_new_session=True,
            env=os.environ | {"PYTHONPATH": os.pathsep.join(paths), "PYTHONWARNINGS": "ignore"},
        )
        try:
            yield process
        finally:
            _end(process)


def _end(process: subprocess.Popen[bytes]) -> None:
    """The watchdog ends all that it watches; where it does not answer, it is killed with its group."""
    process.terminate()
    with suppress(subprocess.TimeoutExpired):
        process.wait(GRACE)
    if process.poll() is None:
        process.kill()
    process.wait()
    if process.stdin is not None:
        with suppress(OSError):
            process.stdin.close()


def _reader(process: subprocess.Popen[bytes]) -> queue.Queue[bytes | None]:
    """Lines of the child as they come, None at the end; a thread reads them, so that waiting can have a limit."""
    lines: queue.Queue[bytes | None] = queue.Queue()

    def read() -> None:
        assert process.stdout is not None
        with suppress(ValueError, OSError):
            for line in process.stdout:
                lines.put(line)
        lines.put(None)
        with suppress(OSError):
            process.stdout.close()  # here, where nobody reads it: what could not be ended may hold the other end

    threading.Thread(target=read, daemon=True).start()
    return lines


def _parsed(line: bytes | None) -> dict[str, Any]:
    try:
        message = json.loads(line or b"{}")
    except ValueError:
        return {}
    return message if isinstance(message, dict) else {}


def _ending(message: dict[str, Any]) -> str:
    """How a worker ended, in words, from the watchdog's last line; empty where there is none."""
    if "stopped" in message:
        return str(message["stopped"])
    if "ended" not in message:
        return _WATCHDOG_ENDED
    code = int(message["ended"])
    if code < 0:
        try:
            name = signal.Signals(-code).name
        except ValueError:
            name = "unknown"
        return f"crashed with signal {-code} ({name})"
    if code == FILES_CLOSED:
        return "ended the check: it closed files of the process that it had not opened,"
    return f"ended the process with exit code {code}"


def _left(running: int) -> CheckFinding:
    """What the FMU started and did not end."""
    if not running:
        return CheckFinding(LEFT, Verdict.PASS, "none is left running")
    return CheckFinding(
        LEFT, Verdict.LIMIT, f"{running} were left running, and ended here", "end what it leaves running after each run"
    )


def _console(console: IO[bytes]) -> CheckFinding:
    """What the FMU printed past its logger; everything a child prints comes from the FMU or from Python dying under
    it.
    """
    size = console.seek(0, os.SEEK_END)
    console.seek(0)
    first = console.readline().decode("utf-8", "replace").strip()[:SHOWN]
    if not size:
        return CheckFinding(_CONSOLE, Verdict.PASS, "nothing is printed past the logger")
    return CheckFinding(_CONSOLE, Verdict.NOTE, f"{size} bytes were printed past the logger, beginning with: {first!r}")
