"""What all algorithms share: one communication step of all components of a plan."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from cosim.coupling.instants import followed, held_signals
from cosim.coupling.plan import Plan
from cosim.master.algorithms.choose import AlgorithmChoice
from cosim.restorable import Restorable


@dataclass(frozen=True)
class IterationSettings:
    """How loops are iterated within a communication step.

    Args:
        method: ``fixed-point``, ``aitken`` or ``newton``.
        max_iterations: sweeps in one step, after which the run fails.
        relative_tolerance, absolute_tolerance: a fed-back value has settled when one more sweep moves it by no more
            than ``absolute + relative * |value|``; the absolute one is in the value's own unit.
        relaxation: of ``fixed-point``, and the first one of ``aitken``.
    """

    method: str = "newton"
    max_iterations: int = 50
    relative_tolerance: float = 1e-9
    absolute_tolerance: float = 1e-12
    relaxation: float = 1.0


class Algorithm(Restorable, ABC):
    """Brings all components of a plan, and its values, over one step.

    An algorithm calls `prepare` (gather the inputs) and `move` of the planned components, and nothing else of the
    components but `save` and `restore`; who watches a plant or notifies a receiver of balises takes their `move` over
    without its knowledge.

    Args:
        plan: prepared, components instantiated.
        iterated: names of the components of each loop that is iterated.

    `choice` says why it is this one.
    """

    name: ClassVar[str]

    def __init__(self, plan: Plan, iterated: Sequence[Sequence[str]] = ()) -> None:
        self.plan = plan
        self.choice = AlgorithmChoice(self.name)
        self._loop_of = {name: i for i, loop in enumerate(iterated) for name in loop}
        components = {step.component.name: step.component for step in plan.steps}
        plan.hold(held_signals(components, plan.connections, list(components), iterated))

    @abstractmethod
    def advance(self, t: float, until: float) -> None:
        """Bring all components from `t` to `until` [s].

        Raises:
            RunError: a component failed.
        """

    def held(self) -> list[str]:
        """Connections whose value is that of the start of a step, as ``a.y -> b.u``."""
        return [str(c) for c in self.plan.connections if c.source_variable in self.plan.held]

    def fresh(self) -> list[str]:
        """Connections whose value is that of the end of a step without any iteration, as ``a.y -> b.u``."""
        components = {step.component.name: step.component for step in self.plan.steps}
        lines = followed(components, self.plan.connections)
        others = [c for c in self.plan.connections if c.source_variable not in self.plan.held | lines]
        loop = self._loop_of
        return [str(c) for c in others if c.source[0] not in loop or loop[c.source[0]] != loop.get(c.target[0])]

    def summary(self) -> Mapping[str, Any]:
        """What to report of it after the run, plain data: the name, why, groups, held and fresh connections,
        iterations.
        """
        found = {"name": self.name, **self.choice.summary(), "held": self.held(), "fresh": self.fresh()}
        played = {
            f"{step.component.name}.{name}": kind
            for step in self.plan.steps
            for kind, names in (("held", step.component.held_outputs), ("line", step.component.line_outputs))
            for name in sorted(names)
        }
        before = self.plan.before_start
        return found | ({"played": played} if played else {}) | ({"before_start": before} if before else {})

    def close(self) -> None:
        """Free what it holds (saved states, threads)."""
        return
