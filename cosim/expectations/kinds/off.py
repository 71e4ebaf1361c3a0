"""An indicator never goes on."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from cosim.expectations.evaluated import Evaluated, at, written
from cosim.expectations.evaluated_run import EvaluatedRun, TimeWindow, span
from cosim.expectations.expectation import IndicatorExpectation, WindowExpectation
from cosim.expectations.indicator_levels import TINY, held, threshold_of


class OffExpectation(IndicatorExpectation, WindowExpectation):
    """An indicator never goes on."""

    check: Literal["off"]

    def evaluate(self, run: EvaluatedRun) -> list[Evaluated]:
        """Never on within the window."""
        name = f"{self.signal} off{span(self.start, self.end)}"
        values, threshold, window = (
            run.recorded(self.signal),
            threshold_of(self.signal, self.threshold),
            run.window(self.start, self.end),
        )
        common: dict[str, Any] = {"check": self.check, "limit": 0.0, "unit": "s"}
        if window.reached < window.start or window.reached == window.start < window.end:
            return [Evaluated(name, passed=False, text=window.unreached, **common)]
        time, shown = held(run.result.time, values, window.start, window.end)
        bad = np.isnan(shown)
        if bad.any():
            when = float(time[np.argmax(bad)])
            return [Evaluated(name, passed=False, when=when, text=f"not a number at {written(when)} s", **common)]
        on = shown > threshold
        if not on.any():
            text = f"stays off (threshold {written(threshold)})" + (f"; {window.unreached}" if window.broken else "")
            common["margin"] = _margin(run.result.time, values, threshold, window)
            return [Evaluated(name, passed=not window.broken, measured=0.0, text=text, **common)]
        until = np.append(time[1:], min(window.end, max(window.reached, window.start)))
        seconds, when = float(np.sum((until - time)[on])), float(time[np.argmax(on)])
        text = f"on for {written(seconds, 's')}{at(when, 'first at')}, expected never"
        common["margin"] = -max(seconds, TINY) / max(window.end - window.start, TINY)
        return [Evaluated(name, passed=False, measured=seconds, when=when, text=text, **common)]


def _margin(time: np.ndarray, values: np.ndarray, threshold: float, window: TimeWindow) -> float:
    """How far an indicator that stays off is from being on: up to 1 by the time between the window and the nearest
    instant at which it is on, in parts of the run; above 1 where it is never on, by the level.

    Time and space robustness: Donze, Maler, Robust satisfaction of temporal logic over real-valued signals (2010).
    """
    on = time[values > threshold]
    if not len(on):
        return 1.0 + float(threshold - np.nanmax(values)) / (abs(threshold) or 1.0)
    distance = np.maximum(window.start - on, on - window.end).clip(0.0).min()
    return float(distance) / max(float(time[-1] - time[0]), TINY)
