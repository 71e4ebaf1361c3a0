"""What a process of its own costs an FMU in a step: ``python tests/benchmarks/isolation.py [VERSION]``.

1, 3 and 10 small FMUs in a chain, with the compiled stepper, here and isolated, each in turn so that a busy machine is
busy for all; on all cores and on one. The least of several runs is printed, in microseconds for a step.
"""

from __future__ import annotations

import logging
import os
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from test_fmus.build import linear_fmu

from cosim import Scenario

STEPS, RUNS = 3_000, 25
LAG = {"A": [[-1.0]], "B": [[1.0]], "C": [[1.0]], "D": [[0.0]]}


def seconds(fmu: Path, count: int, isolate: str) -> float:
    """Of a step of a chain [s]."""
    scenario = Scenario(stop=STEPS * 1e-3, step=1e-3, master={"stepper": "compiled", "isolate": isolate})
    for place in range(count):
        scenario.add(f"part{place}", fmu=str(fmu))
        if place:
            scenario.connect(f"part{place - 1}.y -> part{place}.u")
    outcome = scenario.run(warn=lambda _: None)
    assert outcome.failure is None, outcome.failure
    return float(outcome.result.summary["wall_seconds"]) / STEPS


def main() -> None:
    """Measure and print."""
    logging.disable()
    version = int(sys.argv[1]) if len(sys.argv) > 1 else 2
    with tempfile.TemporaryDirectory() as folder:
        fmu = linear_fmu(Path(folder), "lag", **LAG, inputs=["u"], outputs=["y"], version=version)  # type: ignore[arg-type]
        for cores in (os.sched_getaffinity(0), {min(os.sched_getaffinity(0))}):
            os.sched_setaffinity(0, cores)
            for count in (1, 3, 10):
                least = {"no": 1.0, "component": 1.0}
                for _ in range(RUNS):
                    for isolate, before in least.items():
                        least[isolate] = min(before, seconds(fmu, count, isolate))
                here, apart = least["no"] * 1e6, least["component"] * 1e6
                print(f"{len(cores)} cores, {count:2} FMUs: {here:.2f} us here, {apart:.2f} us isolated", flush=True)


if __name__ == "__main__":
    main()
