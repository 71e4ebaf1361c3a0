"""An indicator never goes on."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from cosim.expectations.expectation import IndicatorExpectation, WindowExpectation
from cosim.expectations.indicator_levels import held, threshold_of
from cosim.expectations.judged import Judged, at, given
from cosim.expectations.judged_run import JudgedRun, span


class OffExpectation(IndicatorExpectation, WindowExpectation):
    """An indicator never goes on."""

    check: Literal["off"]

    def judge(self, run: JudgedRun) -> list[Judged]:
        """Never on within the window."""
        name = f"{self.signal} off{span(self.start, self.end)}"
        values, threshold, window = (
            run.recorded(self.signal),
            threshold_of(self.signal, self.threshold),
            run.window(self.start, self.end),
        )
        common: dict[str, Any] = {"check": self.check, "limit": 0.0, "unit": "s"}
        if window.reached < window.start or window.reached == window.start < window.end:
            return [Judged(name, passed=False, text=window.unreached, **common)]
        time, shown = held(run.result.time, values, window.start, window.end)
        bad = np.isnan(shown)
        if bad.any():
            when = float(time[np.argmax(bad)])
            return [Judged(name, passed=False, when=when, text=f"not a number at {given(when)} s", **common)]
        on = shown > threshold
        if not on.any():
            text = f"stays off (threshold {given(threshold)})" + (f"; {window.unreached}" if window.broken else "")
            return [Judged(name, passed=not window.broken, measured=0.0, text=text, **common)]
        until = np.append(time[1:], min(window.end, max(window.reached, window.start)))
        seconds, when = float(np.sum((until - time)[on])), float(time[np.argmax(on)])
        text = f"on for {given(seconds, 's')}{at(when, 'first at')}, expected never"
        return [Judged(name, passed=False, measured=seconds, when=when, text=text, **common)]
