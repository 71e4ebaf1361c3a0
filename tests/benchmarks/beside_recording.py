"""What runs beside a recording costs, as ratios of CPU time in one run.

``python tests/benchmarks/beside_recording.py [REPETITIONS]`` from the root of the project. One observer beside the
recording over the whole run of `amsterdam_utrecht` (300 s); a comparison of 16 observers over that run with all its
own; a member of a study over its stepping.
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from cpu_time import seconds

from cosim import Scenario
from cosim.choice.benchmark import benchmark_observers
from cosim.choice.candidates import find_candidates
from cosim.choice.playback import find_parts, playback_scenario, recording_scenario
from cosim.results.results_folder import write_results
from cosim.tuning.costs import StateCost
from cosim.tuning.replays import Replays
from fmus.batch.members import Batch

OBSERVERS = 16
MEMBERS = 2000
CURRENTS = (("filter.current_d", "motor.current_d"), ("filter.current_q", "motor.current_q"))


def quietly(scenario: Scenario) -> Any:
    """The outcome of a run."""
    return scenario.run(warn=lambda _text: None)


def line() -> Scenario:
    """The first 300 s of the line."""
    return Scenario.load("amsterdam_utrecht").set("stop", 300.0)


def alone(folder: Path) -> Scenario:
    """One of its observers beside a recording, which is written to a folder."""
    parts = find_parts(line())
    write_results(quietly(recording_scenario(line(), parts)).result, folder, ("npy",))
    (candidate,), _ = find_candidates(line(), parts, ["takagi_sugeno_cdo"])
    return playback_scenario(line(), parts, folder, [candidate])


def of_the_line(repetitions: int) -> None:
    """Print the ratios of runs."""
    with tempfile.TemporaryDirectory() as folder:
        beside = alone(Path(folder))
        deeds: dict[str, Callable[[], object]] = {
            "whole run": lambda: quietly(line()),
            "one observer beside the recording": lambda: quietly(beside),
            f"comparison of {OBSERVERS} observers": lambda: benchmark_observers(line()),
        }
        for deed in deeds.values():
            deed()
        took = [{name: seconds(deed) for name, deed in deeds.items()} for _ in range(repetitions)]
    for name in deeds:
        own, ratio = median(t[name] for t in took), median(t[name] / t["whole run"] for t in took)
        print(f"{name}: {own:.3f} s CPU, {ratio:.2f} of the whole run")


def of_members() -> None:
    """Print the ratio of members over their stepping, and the memory that more of them need."""
    replays = Replays(quietly(Scenario.load("traction_drive").set("expect", [])), "filter")
    cost, stepping, step = StateCost("filter", CURRENTS), [0.0], Batch.run

    def timed(self: Batch, *arguments: Any) -> np.ndarray:
        begun = time.process_time()
        found = step(self, *arguments)
        stepping[0] += time.process_time() - begun
        return found

    Batch.run = timed  # type: ignore[method-assign, assignment]
    draws = np.random.default_rng(1).uniform(1e-4, 1.0, (MEMBERS, 4))
    candidates = [{f"filter.process_variance[{i}]": float(x) for i, x in enumerate(row, 1)} for row in draws]
    for count in (MEMBERS // 10, MEMBERS):
        stepping[0] = 0.0
        took = seconds(lambda count=count: [cost.of(one) for one in replays.outcomes(candidates[:count])])  # type: ignore[misc, arg-type]
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
        print(f"{count} members: {took / stepping[0]:.2f} of their stepping, {1e3 * took / count:.2f} ms each")
        print(f"largest memory so far: {memory:.0f} MB")


if __name__ == "__main__":
    of_the_line(int(sys.argv[1]) if len(sys.argv) > 1 else 5)
    of_members()
