"""Benchmark: what a network of ten nodes adds to a communication step, and to a packet.

Run it with ``python tests/benchmarks/network.py [REPETITIONS]`` from the root of the project. A locomotive, its driver
and its odometer take steps of 1 ms; the ten signals are theirs. All variants run in turn within one process, so that
their ratios hold on a noisy machine; nothing is asserted.
"""

from __future__ import annotations

import sys
from typing import Any

from cosim import Outcome, Scenario

STOP, STEP = 20.0, 1e-3
SIGNALS = (
    *(f"train.{name}" for name in ("position", "speed", "acceleration", "wheel_speed", "slip", "adhesion_force")),
    "train.resistance_force",
    "odometer.reading",
    "odometer.distance",
    "driver.effort",
)
NODES = {f"node_{i}": [signal] for i, signal in enumerate(SIGNALS, 1)}
VARIANTS: dict[str, dict[str, Any]] = {
    "no network": {},
    "cycle 1 s": {"cycle": 1.0},
    "cycle 128 ms, between the points": {"cycle": 0.128},
    "cycle 10 ms": {"cycle": 0.01},
    "cycle 160 ms, try-once-discard": {"cycle": 0.16, "protocol": "try-once-discard"},
    "cycle 160 ms": {"cycle": 0.16},
    "cycle 160 ms, 5 ms late": {"cycle": 0.16, "delay": 5e-3},
}


def run(network: dict[str, Any], stepper: str) -> Outcome:
    """One run.

    Args:
        network: keys of its table, without nodes; empty for none. stepper: of the master.
    """
    made = Scenario(stop=STOP, step=STEP, certificates="ignore")
    made.add("train", model="locomotive", preset="chapter_3_four_axles").add("driver", model="driver")
    made.add("odometer", model="odometer")
    made.connect(
        "driver.effort -> train.effort",
        "train.wheel_speed -> odometer.wheel_speed",
        "odometer.reading -> driver.odometer",
    )
    made.master(stepper=stepper)
    return (made.network(nodes=NODES, **network) if network else made).run(warn=lambda _: None)


def main() -> None:
    """Print microseconds of a step, and what a packet adds, of the fastest of several runs."""
    repetitions = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    for stepper in ("auto", "python"):
        best: dict[str, float] = {}
        packets: dict[str, int] = {}
        compiled: dict[str, int] = {}
        for _ in range(repetitions):
            for name, network in VARIANTS.items():
                result = run(network, stepper).result
                best[name] = min(best.get(name, 1e9), result.summary["wall_seconds"])
                packets[name] = len(result.packets)
                compiled[name] = result.summary["master"]["stepper"]["steps_compiled"]
        steps = round(STOP / STEP)
        print(f"stepper {stepper}: [us] a step, of them compiled, packets, [us] a packet adds")
        for name, seconds in best.items():
            added = (seconds - best["no network"]) / packets[name] * 1e6 if packets[name] else 0.0
            print(f"  {name:32s} {seconds / steps * 1e6:8.2f} {compiled[name]:8d} {packets[name]:8d} {added:8.1f}")


if __name__ == "__main__":
    main()
