"""What a killed process left behind is removed by the next one of its owner, and nothing else is."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from plant_models import left_behind
from plant_models.left_behind import owned

MAKE = """
import os, sys, tempfile
from plant_models.left_behind import owned
folder = tempfile.mkdtemp(prefix=owned(".writing-", sys.argv[1]), dir=sys.argv[1])
open(os.path.join(folder, "file"), "w").close()
handle, name = tempfile.mkstemp(prefix=owned(".pack-", sys.argv[1]), dir=sys.argv[1])
print("made", flush=True)
if sys.argv[2] == "stays":
    sys.stdin.read()
os.kill(os.getpid(), 9)
"""


def made(folder: Path, kind: str) -> subprocess.Popen[str]:
    """A process that has made a folder and a file, and is killed or stays."""
    command = [sys.executable, "-c", MAKE, str(folder), kind]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "made\n"
    if kind == "killed":
        process.stdin.close()  # type: ignore[union-attr] # and nobody asks how it ended: a zombie is no owner
        process.stdout.read()
        process.stdout.close()
        os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)  # its files close before it is a zombie
    return process


@pytest.mark.skipif(sys.platform == "win32", reason="nothing is removed there")
def test_what_the_dead_left_goes_and_what_is_in_use_or_of_others_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    living, killed = made(tmp_path, "stays"), made(tmp_path, "killed")
    (tmp_path / owned(".writing-")).mkdir()
    (tmp_path / ".writing-results").mkdir()
    (tmp_path / f".writing-ffffff-{2**22 - 1}-abc").mkdir()  # of another machine
    (tmp_path / "x").mkdir()
    own = owned("fmu_")
    host, numbered, process, begin = own.removeprefix("fmu_").removesuffix("-").split("-")
    dead = own.replace(f"-{process}-", f"-{2**30}-")
    (tmp_path / f"{dead}link").symlink_to(tmp_path / "x")
    earlier = [tmp_path / f"fmu_{host}-{numbered}-{process}-{int(begin) - 1}-x"] if begin != "0" else []
    container = [tmp_path / f"fmu_{host}-ffffff-{2**30}-{begin}-{k}" for k in range(2)]  # its numbers say nothing here
    for folder in (*earlier, *container):
        folder.mkdir()
    os.utime(container[0], (0.0, 0.0))
    before = {path.name for path in tmp_path.iterdir()}
    assert owned(".made_from-", tmp_path).startswith(".made_from-")
    gone = before - {path.name for path in tmp_path.iterdir()}
    assert len(gone) == 4 + len(earlier)  # the folder and the file, a link, not what it leads to, what is old
    assert container[1].is_dir()
    assert not any(folder.exists() for folder in (*earlier, container[0]))
    assert (tmp_path / "x").is_dir()
    assert len(list(tmp_path.glob(f".*-{living.pid}-[0-9]*-*"))) == 2
    living.communicate("")
    owned(".pack-", tmp_path)
    assert len(list(tmp_path.glob(f".*-{living.pid}-[0-9]*-*"))) == 2  # once in a process
    monkeypatch.setattr(left_behind, "_swept", set())
    owned(".pack-", tmp_path)
    assert not list(tmp_path.glob(f".*-{living.pid}-[0-9]*-*"))
    killed.wait()
