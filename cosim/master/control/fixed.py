"""Fixed communication steps: the way from one point to the next is one step."""

from __future__ import annotations

from collections.abc import Sequence

from cosim.master.control.control import StepControl
from cosim.master.system import Row


class FixedStep(StepControl):
    """Step control without control."""

    name = "fixed"

    def step(self, t: float, until: float) -> Sequence[Row]:  # noqa: D102 - see StepControl
        return self.system.advance(t, until)
