"""What all algorithms share: one communication step of all components of a plan."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

from cosim.coupling.plan import Plan
from cosim.master.algorithms.choose import AlgorithmChoice
from cosim.master.algorithms.links import fed_back, plan_links


class Algorithm(ABC):
    """Brings all components of a plan, and its values, over one step.

    An algorithm calls `prepare` (gather the inputs) and `move` of the planned components, and nothing else of the components but
    `save` and `restore`; who watches a plant or tells a receiver of balises takes their `move` over without its knowledge.

    Args:
        plan: prepared, components initialised.

    `choice` says why it is this one.
    """

    name: ClassVar[str]

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.choice = AlgorithmChoice(self.name)

    @abstractmethod
    def advance(self, t: float, until: float) -> None:
        """Bring all components from `t` to `until` [s].

        Raises:
            RunError: a component failed.
        """

    def held(self) -> list[str]:
        """Connections whose value is that of the communication point before, as ``a.y -> b.u``."""
        return [link.text for link in fed_back(plan_links(self.plan))]

    def save(self) -> Any:
        """What it remembers from step to step, so that a step taken again comes out the same; None where it is nothing."""
        return None

    def restore(self, state: Any) -> None:
        """Return to what was saved."""
        return

    def summary(self) -> Mapping[str, Any]:
        """What to tell of it after the run, plain data: the name, why, groups, held connections, iterations, residuals."""
        return {"name": self.name, **self.choice.summary(), "held": self.held()}

    def close(self) -> None:
        """Free what it holds (saved states, threads)."""
        return
