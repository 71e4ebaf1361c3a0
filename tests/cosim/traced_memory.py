"""How much memory a recorder takes."""

from __future__ import annotations

import tracemalloc

import numpy as np

from cosim.results.recorder import Recorder


def recorded(recorder: Recorder, values: np.ndarray, count: int) -> tuple[np.ndarray, int]:
    """The table of so many equal rows, and the peak of the memory that was taken meanwhile [B]."""
    tracemalloc.start()
    try:
        for k in range(count):
            recorder.add(float(k), values)
        return recorder.table(), tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
