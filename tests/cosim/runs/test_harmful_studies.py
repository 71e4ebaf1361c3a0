"""A study of which some runs crash and some hang: it ends, every run is told, the others have the bits that they have
without, and one that is killed in the middle goes on to the same table.

``STUDY=1000`` makes so many runs.
"""

from __future__ import annotations

import csv
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
from test_fmus.events import DEEDS, hostile_fmu

from cosim import Scenario, load_result
from cosim.runs.journal import JOURNAL, read_lines

pytestmark = [
    pytest.mark.slow,
    pytest.mark.compiler,
    pytest.mark.skipif(sys.platform == "win32", reason="processes are ended by signals"),
]
COUNT = int(os.environ.get("STUDY", "16"))
LIMIT = 1.0
"""Of a call [s]; a step here takes microseconds."""
DEED_OF = {7: "crashes", 13: "hangs"}
"""Two runs of a hundred crash, and one hangs."""
HARMFUL = {k: deed for k in range(COUNT) if (deed := DEED_OF.get(k % 100, "crashes" if k % 50 == 7 else ""))}
GROWTH = 8.0
"""Megabytes that the program that asks may grow from the tenth part of a long study to its end: what it knows of its
runs, a few kB each."""


@pytest.fixture(scope="module")
def scenario(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The integrator that may do harm, and a locomotive's odometer whose noise follows the seed."""
    folder = tmp_path_factory.mktemp("harmful")
    hostile_fmu(folder)
    study = Scenario(stop=0.5, step=0.01, folder=folder, master={"isolate": "no", "call_timeout": LIMIT})
    study.add("bad", fmu="hostile.fmu").add("odometer", model="odometer", **{"as": "block3"})
    study.set("odometer.noise_std", 0.1).connect("bad.y -> odometer.wheel_speed", units="ignore")
    return study.save(folder / "study.toml")


def command(scenario: Path, out: Path, deeds: Sequence[str], *more: str) -> list[str]:
    numbers = ",".join(str(float(DEEDS.index(deed))) for deed in deeds)
    words = ["sweep", str(scenario), "--zip", "--vary", f"seed=0:{COUNT}", "--vary", f"bad.deed={numbers}"]
    return [sys.executable, "-m", "cosim.cli", *words, "--quiet", "--out", str(out), *more]


def deeds() -> list[str]:
    return [HARMFUL.get(k, "nothing") for k in range(COUNT)]


def started(words: list[str]) -> subprocess.Popen[str]:
    streams: Any = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    return subprocess.Popen(words, start_new_session=True, **streams)


def ended(process: subprocess.Popen[str]) -> str:
    """What a study said that is to end with failed runs."""
    said, _ = process.communicate(timeout=60.0 + 10.0 * COUNT)
    assert process.returncode == 1, said
    assert "Traceback" not in said
    return said


def index(out: Path) -> list[dict[str, str]]:
    with (out / "index.csv").open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def without(scenario: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[int, bytes]:
    """Tables of the runs of the study in which nobody does harm."""
    out = tmp_path_factory.mktemp("without") / "out"
    subprocess.run(command(scenario, out, ["nothing"] * COUNT), check=True, capture_output=True)
    return {k: (out / f"run_{k:03d}" / "table.csv").read_bytes() for k in range(COUNT)}


def check(out: Path, said: str, without: dict[int, bytes]) -> None:
    """All runs are told, and those that could end have the same bits as without the others."""
    rows = index(out)
    assert [int(row["run"]) for row in rows] == list(range(COUNT))
    assert f"{COUNT - len(HARMFUL)} of {COUNT} runs done" in said
    for k, row in enumerate(rows):
        words = {"crashes": "SIGSEGV", "hangs": f"has not returned for {LIMIT:g} s", "": ""}[HARMFUL.get(k, "")]
        assert words in row["failure"]
        assert bool(row["failure"]) == (k in HARMFUL)
        assert k in HARMFUL or (out / f"run_{k:03d}" / "table.csv").read_bytes() == without[k]
    for k in HARMFUL:
        assert f"run {k} failed: component 'bad' in doStep at t = 0.24 s" in said
    assert len({without[k] for k in without}) == COUNT  # the noise is another one in each


def watched(process: subprocess.Popen[str], out: Path) -> list[tuple[int, float, int]]:
    """Runs done, memory [MB] and descriptors of the program that asks, now and then."""
    seen = []
    while process.poll() is None:
        time.sleep(0.2)
        for task in Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()[:1]:
            status = Path(f"/proc/{task}/status")
            if status.exists() and (out / JOURNAL).exists():
                resident = status.read_text().partition("VmRSS:")[2].split()
                files = len(list(Path(f"/proc/{task}/fd").iterdir()))
                done = (out / JOURNAL).read_bytes().count(b"\n")
                seen += [(done, float(resident[0]) / 1e3, files)] if resident else []
    return seen


@pytest.mark.parametrize("workers", ["1", "2"])
def test_a_study_with_crashes_and_hangs_ends_and_tells_every_run(
    workers: str, scenario: Path, tmp_path: Path, without: dict[int, bytes]
) -> None:
    process = started(command(scenario, tmp_path / "out", deeds(), "--workers", workers))
    seen: list[tuple[int, float, int]] = []
    if COUNT >= 200 and sys.platform == "linux":  # it says little: its pipe must not fill up
        seen = watched(process, tmp_path / "out")
    check(tmp_path / "out", ended(process), without)
    late = [each for each in seen if each[0] > COUNT / 10]
    if late:
        print(f"workers {workers}: {late[0]} to {late[-1]}")
        assert max(memory for _, memory, _ in late) < late[0][1] + GROWTH
        assert max(files for *_, files in late) <= max(files for *_, files in seen[:20]) + 4


def wait_for(done: Callable[[], bool], process: subprocess.Popen[str]) -> None:
    while not done() and process.poll() is None:
        time.sleep(0.05)


def test_a_study_that_is_killed_in_the_middle_goes_on_to_the_same_table(
    scenario: Path, tmp_path: Path, without: dict[int, bytes]
) -> None:
    out = tmp_path / "out"
    words = command(scenario, out, deeds(), "--workers", "2")
    process = started(words)
    wait_for(lambda: (out / JOURNAL).exists() and len(read_lines(out / JOURNAL)) >= COUNT // 2, process)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    known = read_lines(out / JOURNAL)
    assert COUNT // 2 <= len(known) < COUNT
    for entry in known:
        if entry["failure"] is None:
            assert len(load_result(out / entry["row"]["folder"]).table) == 51
    check(out, ended(started([*words, "--resume"])), without)
    assert len(read_lines(out / JOURNAL)) == COUNT  # nothing was done twice
