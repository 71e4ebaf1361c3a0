"""Ctrl-C while an FMU hangs in a process of its own: the run ends at once, its rows are kept, and the FMU is not
remembered as one that ended a process.
"""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from test_fmus.events import DEEDS, hostile_fmu

from cosim import Scenario
from cosim.run.outcome import INTERRUPTED, Outcome
from fmus.isolation import crashes
from plant_models.disk_cache.files import file_digest

pytestmark = [pytest.mark.compiler, pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="Linux")]

HANGS = 0.6
"""When the key is pressed [s]: starting an FMU takes some hundredths of a second."""
AT_ONCE = 5.0
"""Far below the limit of a call, ten minutes, and of one that ends an FMU, half a minute [s]."""


@contextmanager
def ctrl_c(after: float) -> Iterator[None]:
    """The key is pressed so long after the beginning [s]."""
    timer = threading.Timer(after, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    begin = time.monotonic()
    yield
    assert after < time.monotonic() - begin < after + AT_ONCE
    timer.join()


@pytest.fixture
def fmu(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("FMU_OBSERVER_CACHE", str(tmp_path / "cache"))
    made = hostile_fmu(tmp_path)
    hostile(made, "nothing", "component").run(warn=lambda _: None)  # what is compiled is compiled
    return made


def hostile(fmu: Path, deed: str, isolate: str) -> Scenario:
    scenario = Scenario(stop=0.5, step=0.01, master={"isolate": isolate})
    return scenario.add("bad", fmu=str(fmu), parameters={"deed": float(DEEDS.index(deed))})


@pytest.mark.parametrize("isolate", ["component", "run"])
def test_the_run_ends_at_once_and_keeps_its_rows(fmu: Path, isolate: str) -> None:
    hostile(fmu, "nothing", isolate).run(warn=lambda _: None)  # what is started is started
    with ctrl_c(HANGS):
        outcome = hostile(fmu, "hangs", isolate).run(warn=lambda _: None)
    assert len(outcome.result.table) == 25
    assert outcome.failure == INTERRUPTED
    if isolate == "component":
        assert "fmi2DoStep did not return when the run was interrupted" in " ".join(outcome.warnings)
    assert crashes.noted_crash(file_digest(fmu)) == ""


def test_after_the_run_its_results_were_handed_over_before(fmu: Path) -> None:
    finished: list[Outcome] = []
    with ctrl_c(HANGS), pytest.raises(KeyboardInterrupt):
        hostile(fmu, "hangs-when-freed", "component").run(warn=lambda _: None, finished=finished.append)
    assert len(finished[0].result.table) == 51
    assert crashes.noted_crash(file_digest(fmu)) == ""
