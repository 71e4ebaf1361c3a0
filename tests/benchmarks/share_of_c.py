"""Benchmark: the share of the compiled stepper in the shipped scenarios, what a row costs, what is Python's and why.

Run it with ``python tests/benchmarks/share_of_c.py [--python] [SCENARIO ...]`` from the root of the project, by default
for all shipped scenarios; ``--python`` adds the same by the Python stepper. Seconds are processor time of stepping and
recording, without set-up; nothing is asserted.
"""

from __future__ import annotations

import sys
import time
from typing import Any

from cosim import Scenario
from cosim.master.master import Master
from cosim.run.outcome import Outcome
from cosim.scenario.shipped import shipped_scenarios

NEEDS_A_FILE = frozenset({"own_fmu"})
"""Shipped as a pattern: it runs beside an FMU of the user's."""


def measured(name: str, stepper: str) -> tuple[Outcome, float]:
    """A run, and the processor time from the begin of its initialisation to its last row [s].

    Args:
        name: of a shipped scenario. stepper: of the master.
    """
    spent = [0.0]
    run = Master.run

    def timed(master: Master) -> None:
        begin = time.process_time()
        try:
            run(master)
        finally:
            spent[0] = time.process_time() - begin

    Master.run = timed  # type: ignore[method-assign]
    try:
        outcome = Scenario.load(name).run(overrides={"master.stepper": stepper}, warn=lambda _: None)
    finally:
        Master.run = run  # type: ignore[method-assign]
    return outcome, spent[0]


def line(name: str, *, python: bool) -> str:
    """One line of the table.

    Args:
        name: of a shipped scenario. python: also with the Python stepper.
    """
    outcome, seconds = measured(name, "auto")
    stepper: dict[str, Any] = outcome.result.summary["master"]["stepper"]
    share = stepper.get("share", {"steps": 0.0, "seconds": 0.0})
    rows = len(outcome.result.table)
    slow = f"{1e6 * measured(name, 'python')[1] / rows:10.1f}" if python else ""
    why = stepper["reason"] or "; ".join(stepper.get("in_python", {}).values())
    return (
        f"{name:28} {rows:7d} {100.0 * share['steps']:8.1f} {100.0 * (share['seconds'] or 0.0):8.1f} "
        f"{1e6 * seconds / rows:9.1f}{slow}  {why}"
    )


def main() -> None:
    """Print the table."""
    python = "--python" in sys.argv[1:]
    names = [a for a in sys.argv[1:] if a != "--python"] or [n for n in shipped_scenarios() if n not in NEEDS_A_FILE]
    slow = "  in Python" if python else ""
    print(f"{'scenario':28} {'rows':>7} {'steps %':>8} {'time %':>8} {'us a row':>9}{slow}  Python's")
    for name in names:
        print(line(name, python=python), flush=True)


if __name__ == "__main__":
    main()
