"""What holds for all tests: two tiers, one cache, no deadline on shared machines, the same examples at every continuous
integration.
"""

from __future__ import annotations

import gc
import os
import re
from collections import defaultdict
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from zlib import crc32

import pytest
from hypothesis import settings

# Matrices here have a few rows: a second thread of BLAS makes `expm` of five rows 14 times as dear, and takes the core
# of the other worker. It is said before NumPy is loaded, and inherited by workers and commands.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

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
SECOND_TIER = Path(__file__).with_name("second_tier.txt")
KEPT = "! "
FIRST_TIER = "not slow"
BEGUN = pytest.StashKey[float]()
SPENT = "processor time [s]"
ELSEWHERE: list[float] = []
SAMPLE = 16
"""One test in so many is in the sample, by a digest of its name."""


@cache
def second_tier() -> dict[str, bool]:
    """Beginnings of test names, and whether what begins so belongs to the second tier."""
    lines = [line for line in SECOND_TIER.read_text(encoding="utf-8").splitlines() if line and not line.startswith("#")]
    return {line.removeprefix(KEPT): not line.startswith(KEPT) for line in lines}


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """In the first tier, leave aside the files that belong to the second as a whole: what they import, packages of
    others most of all, is not loaded and need not be there.
    """
    if config.option.markexpr != FIRST_TIER or any(collection_path.name in argument for argument in config.args):
        return None
    name = collection_path.relative_to(config.rootpath).as_posix()
    return True if second_tier().get(name) and not any(line.startswith(f"{name}::") for line in second_tier()) else None


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
    item.user_properties.append((SPENT, processor_time() - item.stash[BEGUN]))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """In continuous integration, tell which files cost most: processor time says it, however busy the machine is."""
    spent: dict[str, float] = defaultdict(float)
    for report in terminalreporter.stats.get("", []):
        spent[report.nodeid.partition("::")[0]] += dict(report.user_properties).get(SPENT, 0.0)
    if not spent or not os.environ.get("CI"):
        return
    dearest = sorted(spent, key=lambda file: -spent[file])[:12]
    terminalreporter.section(f"processor time of tests: {sum(spent.values()):.0f} s, most of it in")
    for file in dearest:
        terminalreporter.write_line(f"{spent[file]:7.1f} s  {file}")


@pytest.fixture(scope="session")
def charge() -> Callable[[float], None]:
    """Adds what was spent for a test in a process that this one has not waited for [s]."""
    return ELSEWHERE.append


def processor_time() -> float:
    """Of this process, of those that it has waited for, and what was charged [s]."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system + sum(ELSEWHERE)


def pytest_collection_finish() -> None:
    """Tests and modules stay to the end: no collection of garbage needs to look at them again."""
    gc.freeze()


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
    """Mark the second tier as slow, and what opens a browser; mark a sample, of each file one at least: not the first,
    which pays for what the others share. In whole files a line that fits none of the tests is an error.
    """
    lines, by_file = second_tier(), defaultdict(list)
    for line in lines:
        by_file[line.partition("::")[0]].append(line)
    used, digests = set(), defaultdict(list)
    for item in items:
        name = item.nodeid
        file = name.partition("::")[0]
        digests[file].append((crc32(name.encode()), item))
        fitting = [beginning for beginning in by_file[file] if name.startswith(beginning)]
        used |= set(fitting)
        if (fitting and lines[max(fitting, key=len)]) or item.get_closest_marker("browser"):
            item.add_marker(pytest.mark.slow)
    for of_a_file in digests.values():
        drawn = [item for digest, item in of_a_file if digest % SAMPLE == 0]
        for item in drawn or [min(of_a_file, key=lambda pair: pair[0])[1]]:
            item.add_marker(pytest.mark.sample)
    # pages and gallery, the longest tests, come first, so that no worker waits for one at the end
    items.sort(key=lambda item: not item.nodeid.startswith("tests/project/"))
    idle = [line for line in lines if line not in used and line.partition("::")[0] in digests]
    if idle and not any("::" in argument for argument in config.args):
        raise pytest.UsageError(f"{SECOND_TIER.name}: no test begins with: {'; '.join(idle)}")
