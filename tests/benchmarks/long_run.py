"""Benchmark: does a run of a million steps beside a moving plant stay flat, in memory and in cost?

``python tests/benchmarks/long_run.py [STEPS]``: `delayed_train_observer`, which remembers the past of its delay, beside
a train whose speed swings about 20 m/s: packets of its odometer every 100 ms, a balise every 5 s, all 150 ms late.
Native (`fmus.Batch`), and in Python for a tenth of the steps. Printed at a quarter, at half and at the end: resident
memory, microseconds an internal step since the last line, and the largest error of the position now since then. Nothing
is asserted.
"""

from __future__ import annotations

import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from fmu_observer.models.train.freight_train_model import MASS, networked_train
from fmu_observer.observers.train import DelayedTrainObserver
from fmus import Batch
from plant_models.hybrid import Runtime, scalar_names

STEPS = 1_000_000
INTERNAL_STEP, PACKET, BALISES, DELAY = 2.5e-3, 0.1, 50, 0.15  # [s], [s], [packets], [s]
MEAN, SWING, FREQUENCY = 20.0, 5.0, 0.1  # [m/s], [m/s], [rad/s]
MARKS = (0.25, 0.5, 1.0)
Move = Callable[[int, int], float]  # from a number of packet to another; returns the largest error


def main(steps: int = STEPS) -> None:
    """Print one line for each mark of each run."""
    print(f"{'':<10}{'steps':>10}{'resident [MB]':>15}{'[us/step]':>11}{'largest error [m]':>19}")
    each = round(PACKET / INTERNAL_STEP)
    for name, make, count in (("native", native, steps), ("Python", python, steps // 10)):
        move, before = make(), 0
        for mark in MARKS:
            reached, began = round(mark * count / each), time.process_time()
            error = move(before, reached)
            cost = 1e6 * (time.process_time() - began) / ((reached - before) * each)
            print(f"{name:<10}{reached * each:>10}{resident():>15.1f}{cost:>11.2f}{error:>19.1e}", flush=True)
            before = reached


def position(t: float) -> float:
    """Of the train [m]."""
    return MEAN * t + SWING / FREQUENCY * (1.0 - float(np.cos(FREQUENCY * t)))


def speed(t: float) -> float:
    """Of the train [m/s]."""
    return MEAN + SWING * float(np.sin(FREQUENCY * t))


def effort(t: float) -> float:
    """What moves it so, by the model [N]."""
    drag = float(MODEL.flow(np.array([0.0, speed(t)]), np.zeros(1))[1])
    return MASS * (SWING * FREQUENCY * float(np.cos(FREQUENCY * t)) - drag)


MODEL = networked_train()


def native() -> Move:
    """A batch of one member."""
    batch = Batch(DelayedTrainObserver(), 1)
    batch.set("delay", DELAY)
    batch.set("effort", effort(0.5 * PACKET))
    batch.start(0.0)

    def move(first: int, last: int) -> float:
        largest = 0.0
        for k in range(first, last):
            t = k * PACKET
            batch.set("effort", effort(t + 0.5 * PACKET))
            batch.notify("packet", 0, t + 0.5 * PACKET, speed=speed(t + 0.5 * PACKET - DELAY))
            if k % BALISES == 0:
                batch.notify("balise", 0, t + 0.6 * PACKET, position=position(t + 0.6 * PACKET - DELAY))
            batch.advance(t + PACKET)
            largest = max(largest, abs(float(batch.get("position")[0]) - position(t + PACKET)) if k > WARM else 0.0)
        return largest

    return move


def python() -> Move:
    """The traced runtime that a block holds."""
    observer = DelayedTrainObserver()
    runtime = Runtime(observer)
    u = {name: i for i, name in enumerate(scalar_names(observer.input_signals))}
    place = scalar_names(observer.outputs).index("position")
    runtime.p[scalar_names(observer.parameter_signals).index("delay")] = DELAY
    runtime.u[u["effort"]] = effort(0.5 * PACKET)
    runtime.start(0.0)

    def move(first: int, last: int) -> float:
        largest = 0.0
        for k in range(first, last):
            t = k * PACKET
            runtime.u[u["effort"]] = effort(t + 0.5 * PACKET)
            runtime.advance(t + 0.5 * PACKET)
            runtime.u[u["packet_speed"]] = speed(t + 0.5 * PACKET - DELAY)
            runtime.trigger("packet")
            if k % BALISES == 0:
                runtime.advance(t + 0.6 * PACKET)
                runtime.u[u["balise_position"]] = position(t + 0.6 * PACKET - DELAY)
                runtime.trigger("balise")
            runtime.advance(t + PACKET)
            if k > WARM:
                largest = max(largest, abs(float(runtime.update_outputs()[place]) - position(t + PACKET)))
        return largest

    return move


WARM = 500  # packets: from then on the error counts


def resident() -> float:
    """Resident memory now [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 2**20


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
