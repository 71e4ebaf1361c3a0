"""Benchmark: a native observer by signatures beside least squares of SciPy over the same windows.

``python tests/benchmarks/signatures.py [SAMPLES]``. The reaction has two pressures and a rate as unknowns; least
squares takes its closed form and starts 10 % beside the truth. Nothing is asserted. Times are CPU seconds of this
process.
"""

from __future__ import annotations

import sys
import time

import numpy as np
import scipy

from fmu_observer.observers.exhibits import ReactionSignature
from fmus import Batch

MEMBERS, PERIOD, TRUE = 200, 0.1, np.array([2.5, 0.5, 0.15])


def main(arguments: list[str]) -> None:
    samples = int((*arguments, "200")[0])
    k = np.arange(11)

    def window(z: np.ndarray) -> np.ndarray:
        first = z[0] / (1.0 + 2.0 * k * PERIOD * z[2] * z[0])
        return 0.5 * (first + z[0] + 2.0 * z[1])

    y = window(TRUE)
    began = time.process_time()
    for _ in range(samples):
        scipy.optimize.least_squares(lambda z: window(z) - y, 1.1 * TRUE)
    theirs = (time.process_time() - began) / samples
    batch = Batch(ReactionSignature(), MEMBERS, preset="wide_samples")
    batch.set("measured_y", float(y[0]))
    batch.start()
    began = time.process_time()
    batch.run([samples * PERIOD])
    own = (time.process_time() - began) / samples / MEMBERS
    print(f"least squares of SciPy: {1e6 * theirs:.0f} us a sample")
    print(f"reaction_signature, native: {1e6 * own:.2f} us a sample, {theirs / own:.0f} times faster")


if __name__ == "__main__":
    main(sys.argv[1:])
