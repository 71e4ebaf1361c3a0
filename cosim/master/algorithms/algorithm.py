"""What all algorithms share: one communication step of all components of a plan."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

from cosim.coupling.plan import Plan


class Algorithm(ABC):
    """Brings all components of a plan, and its values, over one step.

    An algorithm calls `prepare` (gather the inputs) and `move` of the planned components, and nothing else of the components but
    `save` and `restore`; who watches a plant or tells a receiver of balises takes their `move` over without its knowledge.

    Args:
        plan: prepared, components initialised.
    """

    name: ClassVar[str]

    def __init__(self, plan: Plan) -> None:
        self.plan = plan

    @abstractmethod
    def advance(self, t: float, until: float) -> None:
        """Bring all components from `t` to `until` [s].

        Raises:
            RunError: a component failed.
        """

    def summary(self) -> Mapping[str, Any]:
        """What to tell of it after the run, plain data: the name, iterations, residuals."""
        return {"name": self.name}

    def close(self) -> None:
        """Free what it holds (saved states, threads)."""
        return
