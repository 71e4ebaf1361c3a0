"""Benchmark: how many times faster than real time the default scenario and the one over a real line run, and where the
time goes.

Run it with ``python tests/benchmarks/real_time_factor.py [REPETITIONS]``. Variants are run in turn within one process,
so that their ratios hold on a noisy machine; nothing is asserted. Set-up (building or loading FMUs, certificates) is
not counted.
"""

from __future__ import annotations

import statistics
import sys
from collections.abc import Mapping, Sequence

from cosim import Scenario

OBSERVERS = ("differentiator_cdo", "takagi_sugeno_cdo", "multirate_cdo", "discrete_uio")
PLANTS = ("locomotive", "odometer", "driver")
LINE = "amsterdam_utrecht"
VARIANTS = {
    "default: everything as FMI 3 FMUs, the compiled stepper": {},
    "the Python stepper": {"master.stepper": "python"},
    "everything as FMI 2 FMUs": {f"{name}.as": "fmu2" for name in (*PLANTS, *OBSERVERS)},
    "observers as blocks": {f"{name}.as": "block3" for name in OBSERVERS},
    "everything as blocks": {f"{name}.as": "block3" for name in (*PLANTS, *OBSERVERS)},
}


def measure(
    overrides: Mapping[str, str], scenario: str = "freight_profile_d", observers: Sequence[str] = OBSERVERS
) -> dict[str, float]:
    """Real-time factor and microseconds per communication step of one run."""
    loaded = Scenario.load(scenario)
    outcome = loaded.run(warn=lambda _text: None, overrides={"certificates": "ignore", **overrides})
    if outcome.failure is not None:
        raise SystemExit(f"the run failed: {outcome.failure}")
    summary = outcome.result.summary
    steps = (summary["reached"] - summary["start"]) / summary["step"]
    seconds = summary["seconds"]
    plants = [name for name in loaded.table().components if name not in observers]
    return {
        "real-time factor": summary["real_time_factor"],
        "plants [us/step]": sum(seconds[n] for n in plants) / steps * 1e6,
        "observers [us/step]": sum(seconds[n] for n in observers) / steps * 1e6,
        "master [us/step]": seconds["master"] / steps * 1e6,
        "recording [us/step]": seconds["recording"] / steps * 1e6,
    }


def main() -> None:
    """Run all variants in turn and print medians."""
    repetitions = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    runs: dict[str, list[dict[str, float]]] = {name: [] for name in VARIANTS}
    line = f"{LINE}: all its observers"
    runs[line] = []
    on_the_line = [n for n, c in Scenario.load(LINE).table().components.items() if c.observer is not None]
    for _ in range(repetitions):
        for name, overrides in VARIANTS.items():
            runs[name].append(measure(overrides))
        runs[line].append(measure({}, LINE, on_the_line))
    for name, rows in runs.items():
        print(name)
        for key in rows[0]:
            values = [row[key] for row in rows]
            print(
                f"  {key:<22} median {statistics.median(values):8.1f}   min {min(values):8.1f}   max {max(values):8.1f}"
            )


if __name__ == "__main__":
    main()
