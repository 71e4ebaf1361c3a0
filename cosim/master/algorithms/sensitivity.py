"""Sensitivity: how what comes back over an interface depends on it at once, from the components' directional
derivatives.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cosim.components.component import Component
from cosim.coupling.feedthrough import declared_feedthrough
from cosim.coupling.plan import Plan
from cosim.master.algorithms.links import LoopLink
from fmus.fmi.types import FLOATING_TYPES


@dataclass(frozen=True)
class Passage:
    """What passes through one component at once.

    Args:
        component: the component. inputs, outputs: names. sources, factors: column and factor of each input, shape (m,).
        columns: of the outputs, shape (q,). fresh: inputs whose source was stepped before in the sweep, shape (m,).
    """

    component: Component
    inputs: list[str]
    outputs: list[str]
    sources: np.ndarray
    factors: np.ndarray
    columns: np.ndarray
    fresh: np.ndarray

    def gains(self) -> Callable[[], np.ndarray]:
        """A call that gives the directional derivatives of the outputs along each input, shape (q, m)."""
        calls = [self.component.derivative_call(self.outputs, [name], [1.0]) for name in self.inputs]
        return lambda: np.array([call() for call in calls]).T


class Sensitivity:
    """The Jacobian of a sweep over a loop as far as it passes through the components at once.

    Args:
        plan: the plan. members: places of the loop's components. links: of the plan. interface: columns fed back, shape
            (n,).

    `usable` says whether every component through which something passes at once declares directional derivatives.
    """

    def __init__(self, plan: Plan, members: range, links: Sequence[LoopLink], interface: np.ndarray) -> None:
        self._interface, self._count = interface, len(plan.values)
        inner = [link for link in links if link.source in members and link.target in members and not link.held]
        passages = [_passage(plan, place, inner) for place in members]
        self._passages = [p for p in passages if p is not None]
        self.usable = all(p.component.capabilities.providesDirectionalDerivatives for p in self._passages)
        self._gains = [p.gains() for p in self._passages] if self.usable else []

    def __call__(self) -> np.ndarray | None:
        """Derivatives of what comes back, where the components stand, shape (n, n); None where they are not to be
        had.
        """
        if not self.usable:
            return None
        size = len(self._interface)
        imposed, fresh = np.zeros((self._count, size)), np.zeros((self._count, size))
        imposed[self._interface] = np.eye(size)
        try:
            for passage, gains in zip(self._passages, self._gains, strict=True):
                before = np.where(passage.fresh[:, None], fresh[passage.sources], imposed[passage.sources])
                fresh[passage.columns] = gains() @ (passage.factors[:, None] * before)
        except Exception:  # whatever the slave throws: declared, and not given
            self.usable = False
            return None
        found: np.ndarray = fresh[self._interface]
        return found if np.isfinite(found).all() else None


def _passage(plan: Plan, place: int, inner: Sequence[LoopLink]) -> Passage | None:
    """None where nothing passes through a component at once that comes from the loop and goes back into it."""
    step = plan.steps[place]
    component, given = step.component, {link.column for link in inner if link.source == place}
    table = declared_feedthrough(component)
    used = {name for names in table.values() for name in names}
    taken = [
        k
        for k in inner
        if k.target == place
        and _is_real(component, n := step.inputs.names[k.place])
        and _variable(component, n) in used
    ]
    names = {column: plan.signals[column].name.removeprefix(f"{component.name}.") for column in given}
    columns = sorted(
        c for c, name in names.items() if _is_real(component, name) and table.get(_variable(component, name))
    )
    if not taken or not columns:
        return None
    return Passage(
        component,
        [step.inputs.names[link.place] for link in taken],
        [names[column] for column in columns],
        np.array([link.column for link in taken], dtype=np.intp),
        np.array([0.0 if link.place in step.inputs.tables else step.inputs.factors[link.place] for link in taken]),
        np.array(columns, dtype=np.intp),
        np.array([link.source < place for link in taken], dtype=bool),
    )


def _variable(component: Component, name: str) -> str:
    """The variable of this name, or the array that holds the element of this name."""
    found: str = component.variables[name].name
    return found


def _is_real(component: Component, name: str) -> bool:
    return component.variables[name].type in FLOATING_TYPES
