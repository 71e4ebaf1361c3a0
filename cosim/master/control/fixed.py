"""Fixed communication steps: the way from one point to the next is one step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cosim.master.system import Row, System


class FixedStep:
    """Step control without control.

    Args:
        system: what is stepped.
    """

    name = "fixed"

    def __init__(self, system: System) -> None:
        self.system = system

    def step(self, t: float, until: float) -> Sequence[Row]:
        """Bring the system from `t` to `until` [s]; returns the event rows within the step."""
        return self.system.advance(t, until)

    def summary(self) -> Mapping[str, Any]:
        """What to tell of it after the run, plain data."""
        return {"name": self.name}
