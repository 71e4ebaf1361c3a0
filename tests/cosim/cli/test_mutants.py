"""Commands that are given damaged files: each ends soon, with a place where it refuses, without a traceback, and
changes nothing but what it writes.

``MUTANTS=500`` makes so many of each kind.
"""

from __future__ import annotations

import os
import re
import signal
import sys
import time
import traceback
from pathlib import Path
from random import Random

import pytest
from damaged_files import change_archive, change_file, change_folder, copied
from kept_runs import coast
from ssp_files import connector, package, ssd

from cosim.cli import main

pytestmark = [
    pytest.mark.slow,
    pytest.mark.compiler,
    pytest.mark.skipif(not hasattr(os, "fork"), reason="each command has a process of its own"),
]
COUNT = int(os.environ.get("MUTANTS", "6"))
FIRST = int(os.environ.get("MUTANTS_FROM", "0"))
LONGEST = 100.0
"""Wall-clock time of a command [s]; where nothing else runs none needs three."""
BRIEF = "--set stop=0.3 --set step=0.1 --quiet --no-report --out OUT"
SCENARIO = """
title = "Balises beside an observer"
stop = 2.0
step = 0.1
connections = [
    "driver.effort -> train.effort, observer.effort",
    "train.wheel_speed -> driver.odometer, observer.odometer",
]
[components.train]
model = "locomotive"
as = "block3"
parameters = { mass = 80e3 }
[components.driver]
model = "driver"
as = "block3"
[components.observer]
observer = "takagi_sugeno_cdo"
as = "block3"
parameters = { mass = 80e3 }
[balises]
position = "train.position"
speed = "train.speed"
layout = "spacing"
spacing = 5.0
track_end = 100.0
[master]
algorithm = "gauss-seidel"
[report]
true_speed = "train.speed"
observers = ["observer"]
"""
REPLAY = """
stop = 2.0
step = 0.1
connections = ["ride.wheel_speed -> observer.odometer", "ride.effort -> observer.effort"]
[components.ride]
recording = "ride.csv"
[components.observer]
observer = "takagi_sugeno_cdo"
as = "block3"
"""
RIDE = "time [s],wheel_speed [m/s],effort [N]\n"
RIDE += "".join(f"{0.1 * k:.1f},{10 + 0.1 * k:.2f},{5e3}\n" for k in range(21))

LINES = {
    "scenario": f"""
        show scenario.toml
        run scenario.toml {BRIEF}
        list --for scenario.toml
        export scenario.toml OUT.ssp
        certify scenario.toml --no-simulation
    """,
    "recording": f"""
        show replay.toml
        run replay.toml {BRIEF}
        report ride.csv --out OUT.html
        compare ride.csv sound.csv
        export ride.csv OUT.mat
    """,
    "description": """
        info coast.fmu
        show alone.toml
        list --for coast.fmu
        baseline extract coast.fmu OUT.json
    """,
    "package": f"""
        info system.ssp
        show system.ssp
        list system.ssp
        list --for system.ssp
        run system.ssp {BRIEF}
    """,
    "baseline": """
        baseline show baseline.json
        compare baseline.json results
        baseline check baseline.json --against results --quiet
        baseline embed baseline.json coast.fmu -o OUT.fmu
    """,
    "results": """
        report results --out OUT.html
        compare results sound
        show results
        export results OUT.mat
        open results --no-browser --out OUT.html
        rerun results --quiet --set stop=0.3 --out OUT
    """,
}
"""Commands that read what is damaged."""
OWNERS = {
    "scenario.toml": "the run ended early: ",
    "ride.csv": r"replay\.toml: .*\bride\b",
    "baseline.csv": r"baseline\.json",
    "baseline.json": r"baseline\.csv",
    "manifest.json": "results/",
}
"""By a damaged file what else may be named as the place: the file that names it, with the part that is read from it."""
ARCHIVES = {"description": ("coast.fmu", "modelDescription.xml"), "package": ("system.ssp", ".ssd")}


def damage(kind: str, folder: Path, chance: Random) -> Path:
    """Damage a file, an archive or a file in a folder; which one."""
    if kind == "results":
        return change_folder(folder / "results", chance)
    if kind in ARCHIVES:
        name, suffix = ARCHIVES[kind]
        change_archive(folder / name, chance, (suffix,))
        return folder / name
    names = {"scenario": "scenario.toml", "recording": "ride.csv", "baseline": "baseline*"}
    path = chance.choice(sorted(folder.glob(names[kind])))
    change_file(path, chance)
    return path


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of files that nothing is wrong with."""
    folder = tmp_path_factory.mktemp("sound")
    fmu = coast(folder)
    for name, text in (("scenario.toml", SCENARIO), ("replay.toml", REPLAY), ("ride.csv", RIDE), ("sound.csv", RIDE)):
        (folder / name).write_text(text)
    (folder / "alone.toml").write_text('stop = 0.3\nstep = 0.1\n[components.train]\nfmu = "coast.fmu"\n')
    port = f"<ssd:Connectors>{connector('y1', 'output')}</ssd:Connectors>"
    element = f'<ssd:Component name="train" source="resources/coast.fmu">{port}</ssd:Component>'
    structure = ssd(f"<ssd:Elements>{element}</ssd:Elements>")
    package(folder / "system.ssp", {"SystemStructure.ssd": structure, "resources/coast.fmu": fmu})
    lines = (
        f"run {folder}/scenario.toml --out {folder}/results --no-report --quiet",
        f"baseline make {folder}/coast.fmu {folder}/baseline.json --stop 0.3 --step 0.1 --quiet",
    )
    for line in lines:
        assert main(line.split()) == 0
    copied(folder / "results", folder / "sound")
    return folder


def outcome(words: list[str], folder: Path, said: Path, damaged: str) -> str:
    """What is wrong with how a command ended; empty for nothing. What it writes to its streams is kept in a file."""
    child = os.fork()
    if child == 0:
        code = 99
        try:
            os.chdir(folder)
            out = os.open(said, os.O_CREAT | os.O_WRONLY | os.O_TRUNC)
            for stream in (1, 2):
                os.dup2(out, stream)
            sys.stdout, sys.stderr = (os.fdopen(stream, "w") for stream in (1, 2))
            signal.alarm(int(LONGEST))
            code = main(words)
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else 98
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    text = said.read_text(errors="replace")
    if code == -signal.SIGALRM:
        return "it does not end"
    if code not in (0, 1, 2) or "Traceback (most" in text:
        return f"exit code {code}: {text[-3000:]}"
    if code == 2 and not re.search(rf"{re.escape(damaged)}|{OWNERS.get(damaged, '$^')}", text):
        return f"exit code 2 without the place: {text[-500:]}"
    if re.search(r"[\x00\x1b\x80-\x9f\u202e]", text):
        return f"what is in a file reaches the terminal: {text[-500:]!r}"
    return ""


def everything(folder: Path) -> dict[str, tuple[int, int]]:
    """Size and time of change of all files but those that commands are asked for."""
    stamps = {str(p.relative_to(folder)): p.lstat() for p in folder.rglob("*") if p.is_symlink() or not p.is_dir()}
    return {name: (s.st_size, s.st_mtime_ns) for name, s in stamps.items() if "OUT" not in name and name != "said"}


@pytest.mark.parametrize("kind", LINES)
def test_damaged_files_are_refused_in_words(kind: str, sound: Path, tmp_path: Path) -> None:
    lines = [line.split() for line in LINES[kind].strip().split("\n")]
    wrong, begin = [], time.monotonic()
    for number in range(FIRST, FIRST + COUNT):
        chance = Random(f"{kind} {number}")
        folder = copied(sound, tmp_path / "place" / "files")
        damaged = damage(kind, folder, chance).name
        before, words = everything(tmp_path), chance.choice(lines)
        found = outcome(words, folder, tmp_path / "said", damaged)
        after = everything(tmp_path)
        changed = [name for name in before | after if before.get(name) != after.get(name)]
        if found or changed:
            wrong.append(f"{kind} {number}: cosim {' '.join(words)}\n{found}\n{changed or ''}")
    print(f"{COUNT} of {kind} in {time.monotonic() - begin:.0f} s")
    assert not wrong, "\n".join(wrong)
