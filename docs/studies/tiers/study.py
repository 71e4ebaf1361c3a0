"""The study of the tiers: what share of single changes of the code the first tier of tests catches alone.

    python -m pytest -q -p map_tests                 with TEST_MAP=map.first, and with -m slow and TEST_MAP=map.second
    python study.py TREE OUT first map.first         every change against the tests of the first tier
    python study.py TREE OUT second map.second       those that it let pass, against the second
    python study.py TREE OUT table                   what came out

TREE is a copy of the project that nothing else uses: its files are changed and restored. A change meets the tests that
execute its function, cheapest first, then those that execute something else in its file or folder, until one fails or
they have cost `CAP` seconds; tests that fail without a change are left out. OUT gets one JSON line a change and tier.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import casadi  # noqa: F401  what every test needs is loaded once, before the children part
import fmpy  # noqa: F401
import numpy  # noqa: F401
import pytest
import scipy.integrate
import scipy.optimize
import scipy.signal  # noqa: F401
from changes import Change, choose

COUNT, SEED = 240, 14
ROOMS, EACH = 30, 2
"""Of the changes drawn, the first ones of the rooms that come first."""
CAP = 12.0
"""Processor seconds of tests against one change in one tier, as they were measured without it."""

FIRST = 25
"""So many of the tests are tried before all others: most changes are caught by one of them."""

C_USERS = {
    "fmus/runtime": ("fmus/cache.py", "fmus/build.py"),
    "fmus/hosted": ("fmus/hosted/hosted_fmu.py", "fmus/hosted/export.py", "fmus/hosted/slave.py"),
    "cosim/compiled": ("cosim/compiled/",),
}
"""Files in Python that whoever executes C of a room executes too."""


def main(tree: Path, out: Path, tier: str, test_map: Path | None = None) -> None:
    """Run one tier, or print the table."""
    changes = some_of(choose(tree, COUNT, SEED))
    if tier == "table" or test_map is None:
        print(table(changes, read(out)))
        return
    done = {row["number"] for row in read(out) if row["tier"] == tier}
    survivors = {row["number"] for row in read(out) if row["tier"] == "first" and not row["caught"]}
    known = TestMap(test_map)
    for number, change in changes.items():
        if number not in done and (tier == "first" or number in survivors):
            row = {"number": number, "tier": tier, **tried(tree, change, known), **asdict(change)}
            with out.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
            print(
                number,
                tier,
                row["caught"] or "passes",
                change.file,
                change.line,
                change.old,
                "->",
                change.new,
                flush=True,
            )


def some_of(changes: Sequence[Change]) -> dict[int, Change]:
    """By their numbers, `EACH` changes of each of the `ROOMS` rooms that come first."""
    seen: Counter[str] = Counter()
    chosen = {}
    for number, change in enumerate(changes):
        if seen[change.room] < EACH and (change.room in seen or len(seen) < ROOMS):
            seen[change.room] += 1
            chosen[number] = change
    return chosen


class TestMap:
    """Which tests execute a function or a file, with what each costs."""

    def __init__(self, path: Path) -> None:
        self.seconds: dict[str, float] = {}
        self.by_function: dict[str, set[str]] = defaultdict(set)
        self.by_file: dict[str, set[str]] = defaultdict(set)
        self.breadth: dict[str, int] = {}
        for line in path.read_text(encoding="utf-8").splitlines():
            row = json.loads(line)
            if row["passed"]:
                self.seconds[row["test"]], self.breadth[row["test"]] = row["seconds"], len(row["functions"])
                for function in row["functions"]:
                    self.by_function[function].add(row["test"])
                    self.by_file[function.partition(":")[0]].add(row["test"])

    def against(self, change: Change) -> list[str]:
        """Tests that may notice, those of the function first, cheap and narrow ones before others, up to the cap."""
        if change.file.endswith(".py"):
            function = self.by_function[f"{change.file}:{change.function}"]
            users = [self.by_file[change.file]]
        else:
            function = set()
            users = [
                t
                for place, files in C_USERS.items()
                if change.file.startswith(place)
                for f, t in self.by_file.items()
                if f.startswith(files)
            ]
        chosen, spent = [], 0.0
        near = set().union(*users)
        folder = str(Path(change.file).parent) + "/"  # what runs in another process is not seen by the map
        room = set().union(*(tests for file, tests in self.by_file.items() if file.startswith(folder)))
        room = room or set().union(*(t for f, t in self.by_file.items() if f.startswith(str(Path(folder).parent))))
        for group in (function, near - function, room - near - function):
            for test in sorted(group, key=lambda t: self.seconds[t] + 0.0005 * self.breadth[t]):
                spent += self.seconds[test] + 0.005
                if spent > CAP:
                    return chosen
                chosen.append(test)
        return chosen


def tried(tree: Path, change: Change, known: TestMap) -> dict[str, Any]:
    """Which test caught a change, and what that took."""
    tests, path = known.against(change), tree / change.file
    text, stamp = path.read_text(encoding="utf-8"), path.stat()
    begun = _children()
    caught = ""
    try:
        path.write_text(change.applied(text), encoding="utf-8")
        os.utime(path, ns=(stamp.st_atime_ns, stamp.st_mtime_ns + 10**9))  # no byte code of the unchanged file fits
        for part in (tests[:FIRST], tests[FIRST:]):
            caught = caught or (run_tests(tree, part) if part else "")
    finally:
        path.write_text(text, encoding="utf-8")
        os.utime(path, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
    return {"caught": caught, "tests": len(tests), "seconds": round(_children() - begun, 1)}


def run_tests(tree: Path, tests: Sequence[str]) -> str:
    """Runs tests in this order in a child, up to the first that fails: its name, or nothing."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.setsid()
        os.close(reading)
        resource.setrlimit(resource.RLIMIT_CPU, (6 * int(CAP), 6 * int(CAP) + 5))
        quiet = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(quiet, stream)
        os.chdir(tree)
        sys.path.insert(0, str(tree))
        sys.argv[:] = ["pytest"]
        order = _Order(tests)
        files = sorted({test.partition("::")[0] for test in tests})
        code = int(pytest.main(["-x", "-q", "-m", "", "-p", "no:cacheprovider", *files], plugins=[order]))
        os.write(writing, (order.failed or ("" if code in {0, 5} else f"exit code {code} of pytest")).encode())
        os._exit(0)
    os.close(writing)
    limit = time.monotonic() + 40.0 * CAP
    status = 0
    while time.monotonic() < limit:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            break
        time.sleep(0.2)
    else:
        os.killpg(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
    with os.fdopen(reading, "rb") as pipe:
        failed = pipe.read(10_000).decode() if not status else ""
    return failed or (f"ended by status {status}" if status else "")


class _Order:
    """Runs the tests named, in their order, and keeps the name of the first that fails."""

    def __init__(self, tests: Sequence[str]) -> None:
        self.place = {test: k for k, test in enumerate(tests)}
        self.failed = ""

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        items[:] = sorted((i for i in items if i.nodeid in self.place), key=lambda i: self.place[i.nodeid])

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed and not self.failed:
            self.failed = report.nodeid


def _children() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def read(out: Path) -> list[Mapping[str, Any]]:
    """What was written so far."""
    return [json.loads(line) for line in out.read_text(encoding="utf-8").splitlines()] if out.exists() else []


def table(changes: Mapping[int, Change], rows: Iterable[Mapping[str, Any]]) -> str:
    """By room: changes, caught by the first tier, by the second alone, by none."""
    verdicts = {row["number"]: "none" for row in rows}
    for row in rows:
        if row["caught"]:
            verdicts[row["number"]] = row["tier"]
    count = Counter((changes[number].room, verdict) for number, verdict in verdicts.items())
    total = Counter(verdicts.values())
    lines = [f"{'room':28}{'changes':>9}{'first':>7}{'second':>8}{'none':>6}"]
    for room in [*sorted({room for room, _ in count}), "all"]:
        found = [total[v] if room == "all" else count[room, v] for v in ("first", "second", "none")]
        lines.append(f"{room:28}{sum(found):9}{found[0]:7}{found[1]:8}{found[2]:6}")
    share = total["first"] / max(total["first"] + total["second"], 1)
    return "\n".join([*lines, f"The first tier alone catches {share:.1%} of what both catch."])


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve(), sys.argv[3], *map(Path, sys.argv[4:]))
