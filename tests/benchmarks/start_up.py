"""CPU seconds of starting: each command, a script that couples two FMUs, and a run with its parts.

Run it on an idle machine, with what is measured installed, twice: the first run fills the caches.

    python tests/benchmarks/start_up.py [--repeat N]

Each figure is the least of N runs, user and system time of the process and its children. Bytecode is kept, as for an
installed package.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from test_fmus.build import linear_fmu

from fmus.tables.table import Column, Table, name_column

SCENARIO = "freight_profile_d"
SPLIT = """
import sys, time
from time import process_time
marks = [("interpreter", process_time())]
from cosim import Scenario
import cosim.simulation.scenario, cosim.cli.run_command
marks.append(("imports", process_time()))
from cosim.master.master import Master
from cosim.run import checked_observers, loaded_components, services
parts = {}
def timed(module, name, part):
    inner = getattr(module, name)
    def call(*arguments, **how):
        begin = process_time()
        try:
            return inner(*arguments, **how)
        finally:
            parts[part] = parts.get(part, 0.0) + process_time() - begin
    setattr(module, name, call)
timed(loaded_components, "component_factories", "models and loading")
timed(checked_observers, "evaluate_observers", "certificates")
timed(services, "choose_method", "probe")
timed(Master, "run", "stepping")
begin = process_time()
outcome = Scenario.load(SCENARIO).run(warn=lambda _: None)
whole = process_time() - begin
parts["other parts of the run"] = whole - sum(parts.values())
begin = process_time(); outcome.write("out", report=False); parts["writing"] = process_time() - begin
begin = process_time(); outcome.write("out", report=True); parts["report"] = process_time() - begin - parts["writing"]
marks = {"interpreter": marks[0][1], "imports": marks[1][1] - marks[0][1]}
for name, seconds in {**marks, **parts}.items():
    print(f"{name}={seconds}")
""".replace("SCENARIO", repr(SCENARIO))
COUPLED = """
from cosim import Scenario
s = Scenario(stop=1.0, step=0.01)
s.add("a", fmu="lag.fmu").add("b", fmu="lag.fmu").connect("a.y1 -> b.u1", "b.y1 -> a.u1")
s.run(warn=lambda _: None)
"""
LONG = """
step = 0.01
connections = ["a.y1 -> b.u1", "b.y1 -> a.u1"]
components.a.fmu = "lag.fmu"
components.b.fmu = "lag.fmu"
"""
BY_HAND = """
from fmpy import simulate_fmu
simulate_fmu("lag.fmu", stop_time=1.0, output_interval=0.01)
"""


def environment(folder: Path) -> dict[str, str]:
    """The environment of what is measured, with bytecode kept in a folder."""
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    return kept | {"PYTHONPYCACHEPREFIX": str(folder / "bytecode")}


def least_cpu(command: list[str], folder: Path, repeat: int) -> float:
    """The least CPU seconds of several runs of a command [s]."""
    found = []
    for _ in range(repeat + 1):  # the first one writes bytecode
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(
            command,
            cwd=folder,
            env=environment(folder),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            check=True,
        )
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        found.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return min(found[1:])


def split(folder: Path, repeat: int) -> dict[str, float]:
    """CPU seconds of the parts of a run of the default scenario in one process [s], the least of several runs each."""
    least: dict[str, float] = {}
    for _ in range(repeat):
        done = subprocess.run(
            [sys.executable, "-c", SPLIT],
            cwd=folder,
            env=environment(folder),
            stdout=subprocess.PIPE,
            text=True,
            check=True,
        ).stdout
        for line in done.splitlines():
            name, _, seconds = line.partition("=")
            least[name] = min(least.get(name, float("inf")), float(seconds))
    return least


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeat", type=int, default=5)
    repeat = parser.parse_args().repeat
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        linear_fmu(folder, "lag", [[-1.0]], [[1.0]], [[1.0]], [[0.0]], version=2, x0=[1.0])
        for exponent in (5, 6):
            (folder / f"steps_{exponent}.toml").write_text(f"stop = {10.0 ** (exponent - 2)}{LONG}")
        cosim, fmus = ([sys.executable, "-m", f"{name}.cli"] for name in ("cosim", "fmus"))
        commands = {
            "cosim --help": [*cosim, "--help"],
            "cosim --version": [*cosim, "--version"],
            "cosim list": [*cosim, "list"],
            "cosim info lag.fmu": [*cosim, "info", "lag.fmu"],
            f"cosim show {SCENARIO}": [*cosim, "show", SCENARIO],
            "fmus --help": [*fmus, "--help"],
            "fmus list": [*fmus, "list"],
            "script that couples two FMUs": [sys.executable, "-c", COUPLED],
            "fmpy by hand, one FMU": [sys.executable, "-c", BY_HAND],
            "10^5 steps of two FMUs to a CSV": [*cosim, "run", "steps_5.toml", "--no-report", "--quiet"],
            "10^6 steps of two FMUs to a CSV": [*cosim, "run", "steps_6.toml", "--no-report", "--quiet"],
            f"cosim run {SCENARIO} --no-report": [*cosim, "run", SCENARIO, "--no-report", "--quiet"],
            f"cosim run {SCENARIO}": [*cosim, "run", SCENARIO, "--quiet"],
        }
        rows = [[name, f"{least_cpu(command, folder, repeat):.2f}"] for name, command in commands.items()]
        print(Table("commands", [name_column("command", "command"), Column("cpu", "CPU", "s")], rows).text())
        parts = split(folder, repeat)
        rows = [[name, f"{seconds:.3f}"] for name, seconds in parts.items()]
        columns = [name_column("part", f"parts of a run of {SCENARIO}"), Column("cpu", "CPU", "s")]
        print("", Table("parts", columns, rows).text(), sep="\n")


if __name__ == "__main__":
    main()
