"""Benchmark: many members of a system in one loop, and many seeds of a scenario.

``python tests/benchmarks/batch.py [members MEMBERS | seeds SEEDS]``; without arguments 10 000 members of
`takagi_sugeno_cdo` and 100 seeds of ``freight_profile_d``. Nothing is asserted. Times are CPU seconds of this process.
"""

from __future__ import annotations

import resource
import sys

import numpy as np
from cpu_time import seconds

from cosim import Scenario
from cosim.studies.seed_runs import seed_study
from fmus import Batch

SYSTEM, SCENARIO = "takagi_sugeno_cdo", "freight_profile_d"


def main(arguments: list[str]) -> None:
    what, count = ((*arguments, "0")[0], int((*arguments, "0", "0")[1])) if arguments else ("", 0)
    if what in ("", "members"):
        members(count or 10_000)
    if what in ("", "seeds"):
        seeds(count or 100)


def members(count: int) -> None:
    """Microseconds of a member and internal step, by communication step."""
    batch = Batch(SYSTEM, count)
    draws = np.random.default_rng(0)
    batch.set("effort", draws.uniform(-1e4, 5e4, count))
    batch.set("odometer", draws.uniform(0.0, 10.0, count))
    batch.start()
    h = batch.system.internal_step
    for step in (0.001, 0.01, 0.1):
        instants = batch.time + step * np.arange(1, round(0.2 / step) + 1)
        spent = seconds(lambda instants=instants: batch.run(instants))
        print(f"{count} members of {SYSTEM}, steps of {step:g} s: {1e6 * spent / (count * 0.2 / h):.3f} us", flush=True)
        instants = batch.time + step * np.arange(1, round(0.2 / step) + 1)
        spent = seconds(lambda instants=instants: batch.run(instants, ["position", "speed"]))
        print(f"  with two outputs recorded at every step: {1e6 * spent / (count * 0.2 / h):.3f} us", flush=True)


def seeds(count: int) -> None:
    """Seconds of a seed, and how much memory the study takes more than its first run."""
    scenario = Scenario.load(SCENARIO).master(log_calls=False)
    seed_study(scenario, [0])
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    spent = seconds(lambda: seed_study(scenario, range(count)))
    more = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    print(f"{count} seeds of {SCENARIO}: {spent / count:.3f} s a seed, {more / 1024:.0f} MB more than one run")


if __name__ == "__main__":
    main(sys.argv[1:])
