"""Comparisons made by hand: one signal that is too high for two seconds, one that is as it should be, one that is
missing.
"""

from __future__ import annotations

import numpy as np

from cosim.comparison.comparison import Comparison
from cosim.comparison.tolerance import Tolerance
from cosim.comparison.verdict import (
    ComparisonFinding,
    Curves,
    EventComparison,
    EventDifference,
    SignalComparison,
)

ALLOWED = 0.01


def curves(rows: int = 601, excess: float = 0.05) -> Curves:
    """A ramp with a jump at 30 s in 60 s; the result is `excess` too high from 20 to 22 s."""
    time = np.linspace(0.0, 60.0, rows)
    reference = 0.1 * time + np.where(time > 30.0, 2.0, 0.0)
    error = np.where((time >= 20.0) & (time <= 22.0), excess, 0.0)
    gap = int(np.searchsorted(time, 30.0, "right"))
    tube_time, centre = np.insert(time, gap, np.nan), np.insert(reference, gap, np.nan)
    return Curves(
        time, reference, time, reference + error, tube_time, centre - ALLOWED, centre + ALLOWED, time, error, ALLOWED
    )


def differing(name: str = "train.speed", drawn: Curves | None = None, excess: float = 0.05) -> SignalComparison:
    """A signal that differs."""
    text = f"{name}: from 20 to 22 s outside the tube, at worst {excess:g} m/s too high at 21 s (allowed 0.01 m/s)"
    finding = ComparisonFinding("value", 20.0, 22.0, 2.1, 2.1 + excess, excess, ALLOWED, text)
    return SignalComparison(
        name,
        "m/s",
        "differs",
        Tolerance(),
        allowed=ALLOWED,
        allowed_time=1e-6,
        max_error=excess,
        max_error_at=21.0,
        rms_error=0.009,
        share_outside=0.03,
        worst=[(21.0, 2.1, 2.15, excess)],
        findings=[finding],
        curves=curves(excess=excess) if drawn is None else drawn,
    )


def crossing(name: str = "train.position", share: float = 0.4) -> SignalComparison:
    """A signal that uses a share of its tolerance."""
    sizes = {"max_error": share * ALLOWED, "max_error_at": 3.0, "rms_error": 0.001}
    return SignalComparison(name, "m", "within", Tolerance(), ALLOWED, 1e-6, **sizes)


def missing(name: str = "train.slip") -> SignalComparison:
    """A signal that only the reference has."""
    return SignalComparison(name, "1", "missing", Tolerance(), nearest=("train.slip_ratio",))


def different() -> Comparison:
    """All of it, with a telegram that is missing."""
    lost = EventDifference("missing", None, None, "telegram 'B7' (true) of 12 s: missing")
    return Comparison(
        "reference <1>",
        "result",
        [crossing(), differing(), missing()],
        EventComparison(5, [lost], 1e-7),
        ["Other versions of fmpy."],
    )


def equal() -> Comparison:
    """Nothing differs."""
    return Comparison("reference", "result", [crossing(), crossing("train.speed", 0.25)], EventComparison(5))
