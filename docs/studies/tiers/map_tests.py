"""pytest plugin of the study of the tiers: which functions of the package each test executes, and what it costs.

    TEST_MAP=map.jsonl python -m pytest -p map_tests ...

One JSON line a test: its name, its tier, processor seconds with those of its child processes, and functions as
``file:first line``. What a fixture executes while it is set up belongs to each test that uses it. Needs Python 3.12 or
later: `sys.monitoring` reports the first start of each function after a restart and costs nothing after that.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from types import CodeType
from typing import Any

import pytest

ROOT = Path.cwd()
PACKAGES = tuple(str(ROOT / name) + os.sep for name in ("plant_models", "fmu_observer", "fmus", "cosim"))
TOOL = sys.monitoring.PROFILER_ID
EVENT = sys.monitoring.events.PY_START

_seen: set[str] = set()
_failed: set[str] = set()
_by_fixture: dict[int, set[str]] = {}


def _started(code: CodeType, _offset: int) -> object:
    if code.co_filename.startswith(PACKAGES):
        _seen.add(f"{Path(code.co_filename).relative_to(ROOT)}:{code.co_firstlineno}")
    return sys.monitoring.DISABLE


def pytest_configure() -> None:
    sys.monitoring.use_tool_id(TOOL, "test map")
    sys.monitoring.register_callback(TOOL, EVENT, _started)
    sys.monitoring.set_events(TOOL, EVENT)


def pytest_unconfigure() -> None:
    sys.monitoring.set_events(TOOL, 0)


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(fixturedef: pytest.FixtureDef[Any]) -> Iterator[None]:
    before = set(_seen)
    _seen.clear()
    sys.monitoring.restart_events()
    try:
        return (yield)
    finally:
        _by_fixture[id(fixturedef)] = set(_seen)
        _seen.update(before)


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    _seen.clear()
    sys.monitoring.restart_events()
    start = _seconds()
    result = yield
    seconds = _seconds() - start
    functions = set(_seen)
    for definitions in getattr(item, "_fixtureinfo").name2fixturedefs.values():  # noqa: B009
        for definition in definitions:
            functions |= _by_fixture.get(id(definition), set())
    passed = item.nodeid not in _failed
    line = {
        "test": item.nodeid,
        "passed": passed,
        "slow": item.get_closest_marker("slow") is not None,
        "seconds": round(seconds, 3),
    }
    with open(os.environ["TEST_MAP"], "a", encoding="utf-8") as file:  # noqa: PTH123
        file.write(json.dumps(line | {"functions": sorted(functions)}) + "\n")
    return result


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    if report.failed:
        _failed.add(report.nodeid)


def _seconds() -> float:
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system
