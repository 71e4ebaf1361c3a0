"""Benchmark: what memory and predictors of `delayed_state_observer` cost, native, and whether a long run stays flat.

``python tests/benchmarks/delayed.py`` prints microseconds an internal step of the robot arm, four to a reading and one
to a reading, and of a long run at rest how far the memory drifts. Nothing is asserted.
"""

from __future__ import annotations

import time

from fmu_observer.observers.generic.delayed import DelayedStateObserver
from fmus import Batch

STEPS = 100_000
LONG = 1_000_000


def main() -> None:
    """Print one line for each number of predictors."""
    print(f"{'predictors':<12}{'states':>8}{'4 to a reading [us]':>21}{'1 to a reading [us]':>21}{'drift':>10}")
    for predictors in range(4):
        observer = DelayedStateObserver("flexible_joint_arm", predictors=predictors)
        costs = [cost(observer, step) for step in (2.5e-3, 1e-2)]
        print(
            f"{predictors:<12}{observer.state_count:>8}{costs[0]:>21.2f}{costs[1]:>21.2f}{drift(observer):>10.1e}",
            flush=True,
        )


def cost(observer: DelayedStateObserver, internal_step: float) -> float:
    """Microseconds of an internal step, readings included; readings come every 10 ms."""
    batch = Batch(observer, 1)
    batch.set("internal_step", internal_step)
    batch.start(0.0)
    batch.advance(1.0)
    began = time.process_time()
    batch.advance(1.0 + STEPS * internal_step)
    return 1e6 * (time.process_time() - began) / STEPS


def drift(observer: DelayedStateObserver) -> float:
    """Largest output after a million readings at rest."""
    batch = Batch(observer, 1)
    batch.set("internal_step", 1e-2)
    batch.start(0.0)
    batch.advance(LONG * 1e-2)
    return max(abs(float(batch.get(s.name)[0])) for s in observer.model.states)


if __name__ == "__main__":
    main()
