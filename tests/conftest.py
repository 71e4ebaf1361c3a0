"""What holds for all tests: two tiers, one cache, no deadline on shared machines, the same examples at every continuous
integration.
"""

from __future__ import annotations

import gc
import os
import re
import sys
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

# Matrices here have a few rows: a second thread of BLAS makes `expm` of five rows 14 times as dear, and takes the core
# of the other worker. It is said before NumPy is loaded, and inherited by workers and commands.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ["FMU_OBSERVER_ISOLATE"] = "no"  # the FMUs of the tests are their own, and a process costs a second
os.environ.pop("COLUMNS", None)  # workers inherit it where readline has set it: tables are as wide as for a pipe

# The tests start hundreds of commands, and each of these and each collection would compile anew what it loads: where
# byte code is not wanted beside the files it is kept in a folder of its own.
if sys.dont_write_bytecode:
    sys.dont_write_bytecode, sys.pycache_prefix = False, str(Path(__file__).parents[1] / "__pycache__")
    os.environ["PYTHONPYCACHEPREFIX"] = sys.pycache_prefix
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

import tiers  # it loads NumPy

settings.register_profile("here", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "here")

CFLAGS = os.environ.get("CFLAGS", "")
QUICK = f"{CFLAGS} -O0".strip()
AS_SHIPPED = re.compile(
    r"tests/fmus/test_fmu_numbers\.py::.*fmi2"
    r"|tests/fmus/test_batch\.py::test_a_member_is_the_fmu_alone\[(discrete_uio|locomotive)\]"
)
"""Tests of the second tier whose FMUs are built with the flags that users get."""
SECOND = ("slow", "foreign", "browser", "follows")
"""Marks of tests that belong to the second tier whatever they take."""
DECLARED = re.compile(rf"^pytestmark = .*\b({'|'.join(SECOND)})\b", re.MULTILINE)
FIRST_TIER = "not slow"
BEGUN = pytest.StashKey[float]()
SPENT, ALONE = "processor time [s]", "processor time alone [s]"
ELSEWHERE: list[float] = []
PAID: list[float] = []
SHARED: dict[int, float] = {}
"""Processor time of each fixture that tests share [s]: the first of them pays for it."""
SEED = "FMU_OBSERVER_TEST_SAMPLE"
"""Variable of the environment: what draws the sample; the digest of the product unless it is set."""
OF_FIRST, OF_SECOND, OF_UNCHANGED = 16, 6, 16
"""One in so many is in the sample: of the tests of the first tier; of the cases of a law of the second; of pages and
sheets that follow from nothing that changed."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """How the tiers are made."""
    parser.addoption("--measure", action="store_true", help="measure what the tiers follow from; all is in the first")


def pytest_configure(config: pytest.Config) -> None:
    """Workers draw the sample of their controller."""
    if "sample" in config.option.markexpr:
        os.environ.setdefault(SEED, tiers.change())


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """In the first tier, leave aside the files that say that they belong to the second: what they import, packages of
    others most of all, is not loaded and need not be there.
    """
    if config.option.markexpr != FIRST_TIER or collection_path.suffix != ".py":
        return None
    named = any(collection_path.name in argument for argument in config.args)
    return True if not named and DECLARED.search(collection_path.read_text("utf-8")) else None


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(fixturedef: pytest.FixtureDef[Any]) -> Iterator[Any]:
    """What a shared fixture takes counts for each test that uses it: if only the first went to the second tier, the
    next one would pay.
    """
    begun = processor_time()
    result = yield
    if fixturedef.scope != "function":
        SHARED[id(fixturedef)] = processor_time() - begun
        PAID.append(SHARED[id(fixturedef)])
    return result


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """FMUs are built without optimisation, also by the commands that a test starts: the same numbers in a third of the
    compiler's time, and the second tier finds those of the first built. Where the optimised ones are the question they
    are built as users get them.
    """
    shipped = AS_SHIPPED.match(item.nodeid) and item.get_closest_marker("slow")
    os.environ["CFLAGS"] = CFLAGS if shipped else QUICK
    item.stash[BEGUN] = processor_time()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown(item: pytest.Item) -> Iterator[None]:
    """Hand the time to the controller, which knows reports only."""
    yield
    spent = processor_time() - item.stash[BEGUN]
    used = getattr(item, "_fixtureinfo").name2fixturedefs.values()  # noqa: B009
    shared = sum(SHARED.get(id(found[-1]), 0.0) for found in used)
    item.user_properties += [(SPENT, spent), (ALONE, spent - sum(PAID) + shared)]
    PAID.clear()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """In continuous integration, tell which files cost most: processor time says it, however busy the machine is. Where
    it is asked for, write what the tiers follow from. With what drew a sample the same one is drawn again.
    """
    if "sample" in config.option.markexpr:
        terminalreporter.write_line(f"sample drawn by {SEED}={os.environ[SEED]}")
    stats = terminalreporter.stats
    found = {r.nodeid: (dict(r.user_properties), r.keywords) for r in stats.get("", [])}
    if config.option.measure:
        tiers.write_times({name: own[ALONE] for name, (own, marks) in found.items() if "slow" not in marks})
        passed = {report.nodeid for report in stats.get("passed", [])}
        repeated = [name for name, (_, marks) in found.items() if "follows" in marks and name in passed]
        tiers.write_follows({name: found[name][0][tiers.FOLLOWS_FROM] for name in repeated})
    if not found or not os.environ.get("CI"):
        return
    spent: dict[str, float] = defaultdict(float)
    for name, (own, _) in found.items():
        spent[tiers.parts(name)[0]] += own.get(SPENT, 0.0)
    terminalreporter.section(f"processor time of tests: {sum(spent.values()):.0f} s, most of it in")
    for file in sorted(spent, key=lambda file: -spent[file])[:12]:
        terminalreporter.write_line(f"{spent[file]:7.1f} s  {file}")


@pytest.fixture(scope="session")
def charge() -> Callable[[float], None]:
    """Adds what was spent for a test in a process that this one has not waited for [s]."""
    return ELSEWHERE.append


def processor_time() -> float:
    """Of this process, of those that it has waited for, and what was charged [s]."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system + sum(ELSEWHERE)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[object]:
    """Tests and modules stay to the end: no collection of garbage needs to look at them, now or later."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.fixture(scope="session", autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """What tests build is kept for the session, for all its workers together, and never in the user's own cache; for
    several sessions where $FMU_OBSERVER_CACHE names a folder, as in .ci/run.
    """
    temporary = tmp_path_factory.getbasetemp()
    shared = temporary.parent if "PYTEST_XDIST_WORKER" in os.environ else temporary
    folder = Path(os.environ.get("FMU_OBSERVER_CACHE") or shared / "cache")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("FMU_OBSERVER_CACHE", str(folder))
        yield folder


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark as slow what says so and what takes long, and draw the sample where it is asked for."""
    for item in items:
        declared = any(mark.name in SECOND for mark in item.iter_markers())
        dear = tiers.is_dear(item.nodeid) and not item.get_closest_marker("guard")
        if declared or (not config.option.measure and dear):
            item.add_marker(pytest.mark.slow)
    if "sample" in config.option.markexpr:
        for item in _sample(items, os.environ[SEED]):
            item.add_marker(pytest.mark.sample)
    # pages and gallery, the longest tests, come first, so that no worker waits for one at the end
    items.sort(key=lambda item: not item.nodeid.startswith("tests/project/"))


def _sample(items: Iterable[pytest.Item], seed: str) -> Iterator[pytest.Item]:
    """Of the first tier some tests, of each file one at least. Of the second, of each law the cases of the systems that
    are drawn, and one at least where the first has none; and pages and sheets that follow from something that changed.
    """
    first, second = defaultdict(list), defaultdict(list)
    for item in items:
        file, law, _ = tiers.parts(item.nodeid)
        if item.get_closest_marker("follows"):
            if tiers.has_changed(item.nodeid) or tiers.is_drawn(item.nodeid, seed, OF_UNCHANGED):
                yield item
        elif item.get_closest_marker("slow"):
            second[file, law].append(item)
        else:
            first[file].append(item)
    for of_a_file in first.values():
        drawn = [item for item in of_a_file if tiers.is_drawn(item.nodeid, seed, OF_FIRST)]
        yield from drawn or of_a_file[-1:]  # the first of a file pays for what the others share
    laws = {tiers.parts(item.nodeid)[:2] for of_a_file in first.values() for item in of_a_file}
    for law, cases in second.items():
        drawn = [item for item in cases if tiers.is_drawn(_system(item), seed, OF_SECOND)]
        yield from drawn or ([] if law in laws else cases[-1:])


def _system(item: pytest.Item) -> str:
    """Name of the system that a case of a law is about, or of the test."""
    parameters = getattr(getattr(item, "callspec", None), "params", {})
    return str(parameters.get("system_name", parameters.get("name", item.nodeid)))
