"""Benchmark: what a sample of the train's diagnosis costs as compiled C, beside that of the plainest observer.

``python tests/benchmarks/train_diagnosis.py``. Nothing is asserted. Times are CPU seconds of this process.
"""

from __future__ import annotations

import time

import numpy as np

from fmus import Batch

MEMBERS, SAMPLES, PERIOD = 200, 1000, 0.1


def sample_time(system: str, **inputs: float) -> float:
    """Microseconds of a member and sample.

    Args:
        system: its name. inputs: values of its inputs.
    """
    batch = Batch(system, members=MEMBERS)
    for name, value in inputs.items():
        batch.set(name, value)
    batch.start()
    instants = PERIOD * np.arange(1, SAMPLES + 1)
    start = time.process_time()
    batch.run(instants)
    return 1e6 * (time.process_time() - start) / (MEMBERS * SAMPLES)


def main() -> None:
    """Print both, and their ratio."""
    plain = sample_time("odometer_reset", odometer=10.0)
    whole = sample_time("train_diagnosis", odometer_1=10.0, odometer_2=10.0, radar=10.0, effort=3e4)
    print(
        f"a sample of 0.1 s: train_diagnosis {whole:.2f} us, odometer_reset {plain:.2f} us, ratio {whole / plain:.0f}"
    )


if __name__ == "__main__":
    main()
