"""Indicators: from when on they are on, and their thresholds. An indicator holds its value from one row to the next.

Imports NumPy only.
"""

from __future__ import annotations

import numpy as np

BETWEEN_0_AND_1, _BETWEEN_1_AND_2 = 0.5, 1.5
LEVELS = {
    "slip_indicator": _BETWEEN_1_AND_2,
    "condition": _BETWEEN_1_AND_2,
    "adhesion_level": _BETWEEN_1_AND_2,
    "axle_slipping": BETWEEN_0_AND_1,
    "sanding_request": BETWEEN_0_AND_1,
    "adhesion_degraded": BETWEEN_0_AND_1,
}
"""Thresholds of the shipped models' indicators, by name of the output: halfway between nominal and degraded, off and
on.
"""
ROUNDING = 1e-9
TINY = 1e-12
"""Parts of a window that count as none."""


def shipped_threshold(signal: str) -> float | None:
    """Threshold of an indicator of a shipped model, by the name of the signal; None where it is no such indicator."""
    return LEVELS.get(signal.rpartition(".")[2].partition("[")[0])


def first_on(time: np.ndarray, values: np.ndarray, threshold: float, start: float) -> float | None:
    """When an indicator is first on, from `start` on [s]; `start` itself where it is on already; None where it never
    is.

    Args:
        time: not decreasing [s], shape (rows,). values: shape (rows,), each held until the next row.
        threshold: on is above it. start: [s].
    """
    times, values = held(time, values, start, float("inf"))
    on = np.flatnonzero(values > threshold)
    return float(times[on[0]]) if len(on) else None


def held(time: np.ndarray, values: np.ndarray, start: float, end: float) -> tuple[np.ndarray, np.ndarray]:
    """Times and values from `start` to `end`, both included; the value held at `start` counts from there.

    Args:
        time: not decreasing [s], shape (rows,). values: shape (rows,). start, end: [s].
    """
    slack = ROUNDING * max(1.0, abs(start))
    first = max(int(np.searchsorted(time, start + slack, "right")) - 1, 0)
    last = int(np.searchsorted(time, end + slack, "right"))
    return np.maximum(time[first:last], start), values[first:last]


def threshold_of(signal: str, stated: float | None) -> float:
    """The threshold of an indicator, above which it is on.

    Args:
        signal: its name. stated: threshold that was stated, or None.
    """
    return stated if stated is not None else shipped_threshold(signal) or BETWEEN_0_AND_1
