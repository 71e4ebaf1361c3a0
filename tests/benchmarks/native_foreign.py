"""Section ``foreign`` of `native_fmu`: how exact events are in masters of other people; the table of
docs/guide/foreign_masters.md.
"""

from __future__ import annotations

import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "fmus"))

from foreign_loops import MASTERS, Accuracy, accuracy, run_master

HEAD = ("master", "`input_instant`", "stamps", "position", "speed")


def foreign() -> None:
    """Errors of stamps [s], observed position [m] and speed [m/s] by master, with the right and the wrong
    `input_instant`.
    """
    print(f"| {' | '.join(HEAD)} |\n|{'---|' * len(HEAD)}")
    for name, master in MASTERS.items():
        if find_spec(master.package) is None:
            print(f"| {name} | the package {master.package} is not installed | | | |")
            continue
        for input_instant in (1 - master.lag, master.lag):
            with tempfile.TemporaryDirectory(prefix="native-foreign-") as folder:
                found = accuracy(run_master(name, input_instant, Path(folder)), master.lag)
            wrong = "" if input_instant == 1 - master.lag else " (wrong)"
            print(f"| {name} | {input_instant}{wrong} | {numbers(found)} |", flush=True)


def numbers(found: Accuracy) -> str:
    """The cells of a row."""
    return f"{found.stamps:.2g} s | {found.position:.2g} m | {found.speed:.2g} m/s"
