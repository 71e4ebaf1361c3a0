"""FMUs in processes of their own that do harm, in every call: this process goes on, and it is told what happened."""

from __future__ import annotations

import gc
import os
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from harmful_fmus import CALLS, harmful_fmu, processes_of_fmus
from test_fmus.description import Version

from cosim import Scenario
from cosim.components.component import Component
from cosim.components.loading import load_fmu
from cosim.errors import CosimError
from cosim.process.last_call import LAST_CALL
from fmus.isolation.limits import OwnProcess

pytestmark = [pytest.mark.compiler, pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="Linux")]

SMALL = OwnProcess(processes=8, memory=400_000_000, file_bytes=1_000_000)
LIMIT = 0.5
VERSIONS: tuple[Version, ...] = (1, 2, 3)
DEADLY = {
    "segv": "ended with SIGSEGV in ",
    "abort": "ended with SIGABRT in ",
    "exit": "exit code 0 in ",
    "_exit": "exit code 3 in ",
    "spin": "has not returned for 0.5 s",
    "pause": "has not returned for 0.5 s",
    "overflow": "ended with SIGSEGV in ",
    "thread": "ended with SIGSEGV in ",
    "group": "ended with SIGKILL in ",
    "stop": "has not returned for 0.5 s",
    "processes": "it started more than 8 processes",
    "memory": "",  # over the bound, or refused the memory
    "file": "a file became larger than 1000000 bytes",
    "unmap": "ended with SIGSEGV in ",
    "parent": "were ended from outside",
}
"""Deeds that a process does not survive, and what is said of them."""
SURVIVED = ("close", "print", "daemon", "signals", "scribble")
IN_WORDS = {"load": "loading its library", "unload": "unloading its library"}


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Path]:
    return {version: harmful_fmu(tmp_path_factory.mktemp("harmful"), version) for version in VERSIONS}


@pytest.fixture(autouse=True)
def nothing_is_left() -> Iterator[None]:
    LAST_CALL.limit(LIMIT)
    before = _open_files()
    yield
    LAST_CALL.limit(None)
    assert _open_files() == before
    assert not processes_of_fmus()


def _open_files() -> list[str]:
    """What descriptors of this process are of, without those that are closed meanwhile."""
    gc.collect()  # copies of the standard streams are closed with the run that made them
    found = []
    for name in Path("/proc/self/fd").iterdir():
        with suppress(OSError):
            found.append(str(name.readlink()))
    return sorted(found)


def cores_of_fmus() -> list[int]:
    """How many cores each process may use that has an FMU or watches one."""
    return sorted(len(os.sched_getaffinity(int(number))) for number in processes_of_fmus())


@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="there is one core")
def test_fmus_take_turns_on_one_core_where_there_are_more_than_cores_to_spare(
    fmus: dict[int, Path],
) -> None:
    spare = len(os.sched_getaffinity(0)) - 1
    components = [load_fmu(fmus[2], f"part{k}", isolation=SMALL) for k in range(spare + 1)]
    loaded = cores_of_fmus()
    for component in components:
        lived(component)
    assert loaded == [spare + 1] * len(loaded)  # none has been stepped
    assert cores_of_fmus() == [1] * (spare + 1) + [spare + 1] * (spare + 1)  # who watches is free
    for component in components:
        component.terminate()
        component.free()


def harm(monkeypatch: pytest.MonkeyPatch, deed: str, version: int, moment: str) -> None:
    monkeypatch.setenv("HARM", deed)
    monkeypatch.setenv("HARM_IN", CALLS[version][moment])


def lived(component: Component) -> float:
    """What comes out of a life of 20 steps."""
    component.instantiate()
    y = np.zeros(1)
    component.enter_initialization(0.0, 1.0)
    read = component.reader(["y"], y)
    write, u = component.writer(["u"])
    component.exit_initialization()
    for k in range(20):
        u[0] = 0.1 * k
        write()
        component.advance(0.01 * k, 0.01 * (k + 1))
        read()
    return float(y[0])


def what_happened(fmu: Path) -> str:
    """A life that ends badly, in the words of its component."""
    said = ""
    component = None
    try:
        component = load_fmu(fmu, "bad", isolation=SMALL)
        lived(component)
    except CosimError as error:
        said = str(error)
    if component is not None:
        component.terminate()
        component.free()
        said += "; ".join(component.failed_ends)
    return said


@pytest.mark.parametrize("deed", ["segv", "exit"])
@pytest.mark.parametrize("version", VERSIONS)
def test_a_process_that_ends_in_any_call_is_told_and_this_one_goes_on(
    fmus: dict[int, Path], monkeypatch: pytest.MonkeyPatch, version: int, deed: str
) -> None:
    for moment, call in CALLS[version].items():
        harm(monkeypatch, deed, version, moment)
        said = what_happened(fmus[version])
        assert DEADLY[deed] + IN_WORDS.get(moment, f"fmi{'' if version == 1 else version}{call}") in said, moment
        assert "bad" in said


@pytest.mark.slow
@pytest.mark.parametrize("version", VERSIONS)
def test_a_call_that_hangs_is_ended_whichever_it_is(
    fmus: dict[int, Path], monkeypatch: pytest.MonkeyPatch, version: int
) -> None:
    for moment in CALLS[version]:
        harm(monkeypatch, "spin", version, moment)
        begin = time.monotonic()
        assert DEADLY["spin"] in what_happened(fmus[version]), moment
        assert time.monotonic() - begin > 0.8 * LIMIT  # the limit itself, less a tenth


@pytest.mark.parametrize("deed", DEADLY)
def test_what_ends_its_process_is_told(fmus: dict[int, Path], monkeypatch: pytest.MonkeyPatch, deed: str) -> None:
    harm(monkeypatch, deed, 2, "step")
    LAST_CALL.limit(LIMIT if "not returned" in DEADLY[deed] else 10.0)
    said = what_happened(fmus[2])
    assert DEADLY[deed] in said
    if deed != "parent":  # which it may outlive by as many calls as the system takes to end it
        assert "doStep failed" in said
        assert "the last inputs were u = 0" in said


@pytest.mark.parametrize("deed", SURVIVED)
def test_what_its_process_survives_changes_no_number(
    fmus: dict[int, Path], monkeypatch: pytest.MonkeyPatch, deed: str
) -> None:
    component = load_fmu(fmus[2], "good")
    expected = lived(component)
    component.free()
    harm(monkeypatch, deed, 2, "step")
    component = load_fmu(fmus[2], "bad", isolation=SMALL)
    assert lived(component) == expected
    component.terminate()
    component.free()
    assert component.failed_ends == []


@pytest.mark.parametrize("stepper", ["python", "compiled"])
def test_rows_up_to_there_are_kept_and_the_next_run_is_whole(
    fmus: dict[int, Path], monkeypatch: pytest.MonkeyPatch, stepper: str
) -> None:
    scenario = Scenario(stop=0.2, step=0.01, master={"isolate": "component", "stepper": stepper, "call_timeout": 5.0})
    scenario.add("bad", fmu=str(fmus[3])).set("bad.u", 2.0)
    whole = scenario.run(warn=lambda _: None)
    assert whole.failure is None
    harm(monkeypatch, "abort", 3, "terminate")
    assert scenario.run(warn=lambda _: None).failure is None  # it is a warning, of the end
    harm(monkeypatch, "abort", 3, "initialise")
    assert "ended with SIGABRT in fmi3EnterInitializationMode" in str(scenario.run(warn=lambda _: None).failure)
    harm(monkeypatch, "segv", 3, "step")
    ended = scenario.run(warn=lambda _: None)
    assert "Component 'bad' at t = 0 s: doStep failed: its process ended with SIGSEGV in fmi3DoStep" in str(
        ended.failure
    )
    assert len(ended.result.table) == 1
    monkeypatch.delenv("HARM")
    assert scenario.run(warn=lambda _: None).result.table.tobytes() == whole.result.table.tobytes()
