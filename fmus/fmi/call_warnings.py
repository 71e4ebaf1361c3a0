"""Warnings of calls: how often the functions of an instance returned the status warning, which is no failure, or said
what its description does not allow.
"""

from __future__ import annotations

import math

BEYOND_STEP = "a time beyond the end of the step, without an early return"
EARLY_RETURN = "an early return without mightReturnEarlyFromDoStep"
EVENT = "an event without hasEventMode"
CONTRADICTIONS = (BEYOND_STEP, EARLY_RETURN, EVENT)
"""What a doStep may say against the standard or its description; the compiled stepper counts them in this order."""

_MOST_NAMED = 4


class CallWarnings:
    """Functions that returned a warning, or what they said, each with how often it did, and where the instance stood
    at the first one.
    """

    def __init__(self) -> None:
        self.calls: dict[str, tuple[int, float]] = {}

    def add(self, function: str, time: float, count: int = 1) -> None:
        """Count warnings.

        Args:
            function: of the standard, e.g. ``fmi2DoStep``, or of `CONTRADICTIONS`.
            time: where the instance stood at the first of them [s]; NaN before initialisation.
            count: how many.
        """
        known, first = self.calls.get(function, (0, time))
        self.calls[function] = known + count, first if math.isnan(first) else min(first, time)  # NaN is before all

    def __bool__(self) -> bool:
        return bool(self.calls)

    def __str__(self) -> str:
        most = sorted(self.calls.items(), key=lambda item: -item[1][0])
        more = f", and {len(most) - _MOST_NAMED} functions more" if len(most) > _MOST_NAMED else ""
        return ", ".join(f"{name} {_times(*counted)}" for name, counted in most[:_MOST_NAMED]) + more


def _times(count: int, first: float) -> str:
    often = "once" if count == 1 else f"{count} times, first"
    return f"{often} before initialisation" if math.isnan(first) else f"{often} at t = {first:.6g} s"
