"""Commands that are ended at random moments: killed, asked to end, or with the folder that they write to full,
read-only or gone. What is on the disk afterwards is read, no message says otherwise, and the next command goes on from
it.

``ENDS=50`` makes so many of each kind, ``ENDS_FROM=6`` begins with the seventh.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest

from cosim import load_result
from cosim.errors import OutputError
from cosim.runs.journal import JOURNAL, read_lines

pytestmark = [
    pytest.mark.slow,
    pytest.mark.compiler,
    pytest.mark.skipif(sys.platform == "win32", reason="signals and folders as Unix has them"),
]
COUNT, FIRST = int(os.environ.get("ENDS", "2")), int(os.environ.get("ENDS_FROM", "0"))
LONGEST = 120.0
"""Wall-clock time of a command [s]; where nothing else runs none needs four."""
AS_OTHERS = ["setpriv", "--bounding-set=-dac_override,-dac_read_search"] if os.getuid() == 0 else []
"""To root no folder is read-only unless it gives up that right."""
SIGNALS = {"kill": signal.SIGKILL, "term": signal.SIGTERM, "int": signal.SIGINT, "hup": signal.SIGHUP}
DEEDS = (*SIGNALS, "kill all", "full", "read-only", "vanished")
SCENARIO = """
stop = 100.0
step = 0.01
[components.train]
model = "locomotive"
as = "block3"
parameters = { train_speed = 10.0, wheel_rate = 17.4, effort = 5e4 }
[master]
stepper = "python"
[[expect]]
check = "signal"
name = "it is fast"
signal = "train.speed"
from = 0.05
min = 9.0
"""
SHORT = "--set stop=1"
COMMANDS = {
    "run": "cosim run ride.toml --no-report --out out",
    "stream": "cosim run ride.toml --no-report --out out --stream",
    "sweep": f"cosim sweep ride.toml {SHORT} --vary train.mass=60e3,70e3,80e3,90e3 --out out",
    "sweep of two": f"cosim sweep ride.toml {SHORT} --vary train.mass=60e3,70e3,80e3,90e3 --workers 2 --out out",
    "tune": f"cosim tune ride.toml {SHORT} --parameters train.mass=60e3:120e3 --cost=-expectation:fast --method hand "
    "--iterations 4 --option step=0.3 --out out",
    "build": "fmus build braked_oscillator -o out",
}
SPARED = {"int": 0.6}
"""While the program is loaded Ctrl-C is Python's own [s]."""
CLAIM = re.compile(r"(\d+) rows (?:are kept )?in (\S+?)[.;]?(?:\s|$)")
"""How many rows a message says lie where."""
PLACE = re.compile(r"(?:stands in|written before:) (\S+?)(?: instead\.|\s|$)")


@dataclass
class Command:
    """How a command ended."""

    code: int
    said: str


class Desk:
    """A folder in which commands are run."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.out = folder, folder / "out"
        places = {"FMU_OBSERVER_CACHE": "cache", "HOME": ".", "TMPDIR": "tmp"}
        self.environment = os.environ | {name: str(folder / place) for name, place in places.items()}
        (folder / "ride.toml").write_text(SCENARIO)

    def start(self, words: str) -> subprocess.Popen[str]:
        program, *rest = words.split()
        command = [*AS_OTHERS, sys.executable, "-m", f"{program}.cli", *rest]
        streams: Any = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        return subprocess.Popen(command, cwd=self.folder, env=self.environment, start_new_session=True, **streams)

    def ended(self, process: subprocess.Popen[str]) -> Command:
        try:
            said, _ = process.communicate(timeout=LONGEST)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            raise
        return Command(process.returncode, said)

    def run(self, words: str) -> Command:
        return self.ended(self.start(words))

    def clear(self, kind: str) -> None:
        """Nothing of former commands is left but the cache, which is what a build is about."""
        for path in self.folder.iterdir():
            if path.name != "ride.toml" and (path.name != "cache" or kind == "build"):
                shutil.rmtree(path, ignore_errors=True)
        for name in ("tmp", "out", "cache"):
            (self.folder / name).mkdir(exist_ok=True)


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Desk:
    return Desk(tmp_path_factory.mktemp("ends"))


@dataclass(frozen=True)
class Whole:
    """What a command leaves that nobody ends, and how long it takes [s]."""

    seconds: float
    tables: dict[str, np.ndarray]
    files: dict[str, str]


def undisturbed(desk: Desk, kind: str) -> Whole:
    """What a command leaves that nobody ends."""
    words = COMMANDS[kind]
    desk.clear(kind)
    done = desk.run(words)  # what is made once is in the cache then
    assert done.code == 0, done.said
    desk.clear(kind)
    begin = time.monotonic()
    assert desk.run(words).code == 0
    seconds = time.monotonic() - begin
    tables = {name: load_result(place).table.copy() for name, place in results(desk.out)}
    texts = {name: path.read_text() for name in ("index.csv", "tuned.toml") if (path := desk.out / name).exists()}
    return Whole(seconds, tables, texts)


def results(out: Path) -> Iterator[tuple[str, Path]]:
    """Results folders, by the name of the run."""
    if (out / "summary.json").exists():
        yield "", out
    for path in sorted(out.glob("run_*")):
        yield path.name, path


def do(deed: str, process: subprocess.Popen[str], out: Path) -> None:
    if process.poll() is not None:
        return
    if deed in SIGNALS:
        process.send_signal(SIGNALS[deed])
    elif deed == "kill all":
        os.killpg(process.pid, signal.SIGKILL)
    elif deed == "vanished":
        shutil.rmtree(out, ignore_errors=True)
    elif deed == "read-only":
        for path in (*(p for p in out.rglob("*") if p.is_dir()), out):
            path.chmod(0o555)


def writable(out: Path) -> None:
    out.chmod(0o755)
    for path in out.rglob("*"):
        if path.is_dir():
            path.chmod(0o755)


def wrong(desk: Desk, kind: str, whole: Whole, number: int) -> str:
    """What is wrong with how a command ended and with what it left; empty for nothing."""
    chance = Random(f"{kind} {number}")
    deed, moment = chance.choice(DEEDS), chance.uniform(0.0, 1.1) * whole.seconds
    desk.clear(kind)
    mounted = deed == "full" and mount(desk.out, chance.choice((30, 60, 100, 200, 400, 1000)))
    try:
        process = desk.start(COMMANDS[kind])
        time.sleep(max(moment, SPARED.get(deed, 0.0)))
        do(deed, process, desk.out)
        done = desk.ended(process)
        label = f"{kind} {number}: {deed} after {moment:.2f} s, exit code {done.code}\n{done.said[-1500:]}\n"
        if desk.out.exists():
            writable(desk.out)
        faults = [*ending(deed, done), *left(desk, done, whole)] if deed != "vanished" or done.code else []
        if not mounted:
            faults += afterwards(desk, kind, whole)
    finally:
        if mounted:
            subprocess.run(["umount", "--lazy", str(desk.out)], check=True)
    return label + "\n".join(faults) if faults else ""


def mount(out: Path, size: int) -> bool:
    """Whether there is a disk of so many kilobytes in place of the folder."""
    words = ["mount", "-t", "tmpfs", "-o", f"size={size}k,mode=777", "tmpfs", str(out)]
    return subprocess.run(words, check=False, capture_output=True).returncode == 0


def ending(deed: str, done: Command) -> Iterator[str]:
    """What is wrong with how a command ended."""
    if "Traceback (most" in done.said:
        yield "a traceback"
    codes = {0, 1, 2, 130, *((-signal.SIGKILL,) if "kill" in deed else ())}
    codes |= {-SIGNALS[deed]} if deed in SIGNALS else set()
    if done.code not in codes:
        yield f"exit code {done.code}"
    if done.code == 2 and "cosim: " not in done.said and "fmus: " not in done.said:
        yield "it failed without a word"


def left(desk: Desk, done: Command, whole: Whole) -> Iterator[str]:
    """What is wrong with what lies on the disk and with what is said of it."""
    claims = [*CLAIM.findall(done.said), *(("", place) for place in PLACE.findall(done.said))]
    simulated = re.search(r"([\d.]+) s simulated in", done.said)
    if simulated and float(simulated[1]) > 0.0 and not claims:
        claims = [("", "out")]  # what was computed must be somewhere
    for rows, place in claims:
        found = read(desk.folder / place)
        if isinstance(found, str) or rows not in ("", str(len(found))):
            yield f"{place} is said to hold {rows or 'the'} rows: {found}"
    for name, expected in whole.tables.items():
        place = desk.out / name
        found = read(place)
        if isinstance(found, str):
            files = [p for p in place.rglob("*") if p.name in ("table.npy", "table.csv", ".block") and rows_in(p)]
            if files:
                yield f"{found}, and yet there are {files}"
        elif found.dtype != expected.dtype or not np.array_equal(found, expected[: len(found)]):
            yield f"{place}: its {len(found)} rows are not the first ones of {len(expected)}"
    for path in desk.out.glob("*.fmu"):
        if not zipfile.is_zipfile(path) or zipfile.ZipFile(path).testzip() is not None:
            yield f"{path} is not whole"


def read(place: Path) -> np.ndarray | str:
    """The table of a results folder, or why there is none."""
    try:
        return load_result(place).table
    except OutputError as error:
        return str(error)


def rows_in(path: Path) -> bool:
    """Whether a file has rows: more than its head."""
    content = path.read_bytes()
    if path.name == ".block":
        return bool(np.frombuffer(content[8:16], np.int64).any())
    if path.suffix == ".csv":
        return content.count(b"\n") > 1
    return b"'shape': (0,)" not in content[:4096] and len(content) > 0


def afterwards(desk: Desk, kind: str, whole: Whole) -> Iterator[str]:
    """What is wrong with the next command in the same folder, which goes on where it can."""
    known = len(read_lines(desk.out / JOURNAL))
    again = desk.run(COMMANDS[kind] + (" --resume" if kind in ("sweep", "sweep of two", "tune") else ""))
    if again.code != 0 or "Traceback" in again.said:
        yield f"the next one ends with {again.code}: {again.said[-800:]}"
        return
    yield from left(desk, again, whole)
    tables = {name: load_result(place).table for name, place in results(desk.out)}
    if tables.keys() != whole.tables.keys() or any(not np.array_equal(tables[n], whole.tables[n]) for n in tables):
        yield f"after the next one there are not the same tables: {[*tables]}"
    for name, text in whole.files.items():
        if (desk.out / name).read_text() != text:
            yield f"{name} is another one than without an end ({known} runs were known)"
    hidden = [p for p in desk.out.rglob(".*") if p.name not in (".gitignore",)]
    if hidden:
        yield f"left behind: {hidden}"


@pytest.mark.parametrize("kind", COMMANDS)
def test_what_is_left_is_read_and_told_truly(kind: str, desk: Desk) -> None:
    whole = undisturbed(desk, kind)
    found = [wrong(desk, kind, whole, number) for number in range(FIRST, FIRST + COUNT)]
    assert not any(found), "\n\n".join(filter(None, found))
