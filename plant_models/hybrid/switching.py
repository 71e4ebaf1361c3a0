"""Steps divided at switches: an internal step ends where a switching function changes its sign, and the next begins
there.

Mirrored by `switching.c` of the C runtime; change the two together. Knows kernels, and nothing of grids and events.
"""

from __future__ import annotations

from math import ulp
from typing import Protocol

MOST_SWITCHES = 100  # in one internal step; what chatters more is no longer divided
MOST_DIVISIONS = 100_000  # between two events; what chatters more is given up, each division costs some 50 trials


class ChatteringError(RuntimeError):
    """A switch changes so often that a step would take hours.

    Args:
        switch: its name. t: time of its last change [s].
    """

    def __init__(self, switch: str, t: float) -> None:
        super().__init__(
            f"event_indicator.{switch} changes its sign without end at {t!r} s; check inputs and parameters"
        )
        self.switch, self.t = switch, t


class _SwitchTrial(Protocol):
    """A kernel that can try an internal step.

    Attributes:
        divisions: of internal steps since the last event or end of a step.
    """

    divisions: int

    def attempt(self, t: float, h: float) -> bool:
        """Compute the state after an internal step of length `h` [s] from `t` [s]; whether a switch changes on the
        way.
        """

    def accept(self) -> None:
        """Take the state computed last."""

    def accept_change(self, t: float, h: float) -> str:
        """Take the state computed last, after a step of length `h` [s] from `t` [s]; the switch that changed on it."""


def divided_step(kernel: _SwitchTrial, t: float, h: float) -> None:
    """Advance by one internal step of length `h` [s] from `t` [s], divided where switches change.

    Args:
        kernel: one step that may fail where a switch changes.

    Raises:
        ChatteringError: a switch changes without end.
    """
    end = t + h
    divisions = 0
    while kernel.attempt(t, h) and divisions < MOST_SWITCHES:
        divisions += 1
        h = _until_switch(kernel, t, h)
        kernel.attempt(t, h)
        kernel.divisions += 1
        if kernel.divisions > MOST_DIVISIONS:
            raise ChatteringError(kernel.accept_change(t, h), t + h)
        kernel.accept()
        t, h = t + h, end - (t + h)
        if h <= 0.0:
            return
    kernel.accept()


def _until_switch(kernel: _SwitchTrial, t: float, h: float) -> float:
    """The shortest step [s] after which a switch has changed, to the resolution of time, where one has after `h`
    [s].
    """
    before, after, resolution = 0.0, h, 4.0 * ulp(t + h)
    while after - before > resolution:
        middle = 0.5 * (before + after)
        if kernel.attempt(t, middle):
            after = middle
        else:
            before = middle
    return after
