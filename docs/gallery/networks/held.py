"""The tanh plant of Hann 2014 beside an observer at samples: errors along a run, and where it first fails."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from shared.runner import Together

from fmu_observer.models.exhibits.tanh_model import Reading, tanh_system
from fmu_observer.observers.generic.sampled import DecayingInnovation
from plant_models.exhibits import TanhSystem
from plant_models.hybrid import Runtime

HORIZON, LAST, FOUND = 80.0, 10.0, 1e-2  # [s], [s]; an observer works where its error stays below this at the end
GRID = 0.02  # [s], of the periods tried
GAINS = {"printed": (10.0, (1.0, 2.0)), "repaired": (5.0, (2.0, 1.0)), "weaker": (5.0, (2.0, 0.8))}
DECAYS = {"constant": (0.0, 1.0), "a = 1": (10.0, 1.0), "a = 0.5": (10.0, 0.5), "a = 0.25": (10.0, 0.25)}


def pair(
    gains: str, decay: str, reading: Reading = "minus", make: Any = None, step: float = 1e-2, **parameters: Any
) -> Together:
    """Plant and observer, the observer at (0, 0).

    Args:
        gains: key of `GAINS`. decay: key of `DECAYS`. make: another observer than that of (3.72). step: internal [s].
        parameters: of it.
    """
    if make is None:
        theta, K = GAINS[gains]
        rate, exponent = DECAYS[decay]
        parameters = {"theta": theta, "high_gain": K, "decay_rate": rate, "decay_exponent": exponent}
    observer = (make or DecayingInnovation)(tanh_system(reading))
    seen = lambda y, noise: {"sample_x1": y["x1"] + noise}  # noqa: E731
    return Together(TanhSystem(reading), observer, seen, step=step, **parameters)


class Run:
    """One pair, run again and again."""

    def __init__(self, both: Together) -> None:
        self.runtime = Runtime(both)

    def errors(
        self, period: float, stop: float, variance: float = 0.0, hold: float = 0.05, start: float = 0.0
    ) -> tuple[Any, Any]:
        """Times every `hold` [s], from `start` [s] on, and errors, shape (K, 2); samples from 0 on, noise drawn anew at
        each.
        """
        runtime, numbers = self.runtime, np.random.default_rng(7)
        runtime.reset()
        runtime.start(0.0)
        rows, times = [], []
        instants = period * np.arange(round(stop / period) + 1)
        marks = hold * np.arange(1 + round(start / hold), round(stop / hold) + 1)
        sampled = 0
        for mark in marks:
            while sampled < len(instants) and instants[sampled] <= mark + 1e-9:
                runtime.advance(instants[sampled])
                runtime.u[0] = np.sqrt(variance) * numbers.standard_normal()
                runtime.trigger("sample")
                sampled += 1
            runtime.advance(mark)
            rows.append(runtime.update_outputs().copy())
            times.append(mark)
            if not np.abs(rows[-1]).max() < 1e6:
                break
        return np.array(times), np.array(rows)

    def works(self, period: float, stop: float = HORIZON) -> bool:
        """Whether the error stays small over the last seconds."""
        times, found = self.errors(period, stop, hold=0.01, start=stop - LAST)
        return bool(times[-1] > stop - 0.1 and np.abs(found).max() < FOUND)

    def first_failure(self, near: float) -> float:
        """First period of the grid [s] at which it does not work: bisection around `near` [s], then all a little
        below, since a period that fails may lie between two that work.
        """
        low, high = round(0.5 * near / GRID), round(1.6 * near / GRID) + 1
        found = bisection(low, high, lambda k: self.works(GRID * k))
        below = (k for k in range(round(0.9 * found), found) if not self.works(GRID * k))
        return GRID * next(below, found)


def bisection(low: int, high: int, works: Callable[[int], bool]) -> int:
    """The first whole number that does not work, between one that does and one that does not."""
    low = low if works(low) else 0
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if works(middle) else (low, middle)
    return high
