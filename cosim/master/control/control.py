"""What all step controls share: the way from one communication point to the next."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from cosim.master.system import Row, System


class StepControl(ABC):
    """Divides the way from one communication point to the next into steps of the system.

    Args:
        system: what is stepped.
    """

    name: ClassVar[str]

    def __init__(self, system: System) -> None:
        self.system = system

    @abstractmethod
    def step(self, t: float, until: float) -> Sequence[Row]:
        """Bring the system from `t` to `until` [s]; returns the event rows within the step.

        Raises:
            RunError: a component failed.
        """

    def summary(self) -> Mapping[str, Any]:
        """What to report of it after the run, plain data."""
        return {"name": self.name}

    def warnings(self) -> list[str]:
        """What the user should know after the run."""
        return []
