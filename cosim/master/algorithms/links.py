"""Links of a plan: which component takes which value of which other one. Reads the plan only."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from cosim.coupling.plan import Plan
from cosim.coupling.planned import PlannedComponent


@dataclass(frozen=True)
class LoopLink:
    """One connection as the plan holds it.

    Args:
        text: ``a.y -> b.u``. column: of the source within the values. source, target: places of the components in the
            plan.
        place: of the input among the connected inputs of its component.
        held: whether the value is that of the start of a step.
    """

    text: str
    column: int
    source: int
    target: int
    place: int
    held: bool


def plan_links(plan: Plan) -> list[LoopLink]:
    """All connections of a plan between components that are stepped, in its order."""
    owner = [place for place, step in enumerate(plan.steps) for _ in range(step.columns.start, step.columns.stop)]
    return [
        LoopLink(
            f"{plan.signals[column].name} -> {step.component.name}.{name}",
            int(column),
            owner[column],
            target,
            place,
            held,
        )
        for target, step in enumerate(plan.steps)
        for place, (name, column, held) in enumerate(
            zip(step.inputs.names, step.inputs.sources, step.inputs.held.tolist(), strict=True)
        )
        if column < len(owner)
    ]


def _fed_back(links: Sequence[LoopLink], members: range | None = None) -> list[LoopLink]:
    """Links whose target is stepped no later than their source, among consecutive members of the plan or among all."""
    return [
        link
        for link in links
        if link.target <= link.source and (members is None or (link.source in members and link.target in members))
    ]


def interface(links: Sequence[LoopLink], members: range | None = None) -> np.ndarray:
    """Columns of the values that are fed back, each once, ascending, shape (n,).

    Args:
        links: between the components of the loop. members: of the loop, by number; None for all.
    """
    # a set, since `np.unique` loads the masked arrays of NumPy
    return np.array(sorted({link.column for link in _fed_back(links, members)}), dtype=np.intp)


def downstream(plan: Plan, names: Collection[str]) -> np.ndarray:
    """Mask of the values of components that take something of the named ones, directly or round about, shape (n,).

    Args:
        plan: of the run. names: of components.
    """
    links = plan_links(plan)
    reached: set[int] = set()
    new = {place for place, step in enumerate(plan.steps) if step.component.name in names}
    while new:
        new = {link.target for link in links if link.source in new} - reached
        reached |= new
    mask = np.zeros(len(plan.values), dtype=bool)
    for place in reached:
        mask[plan.steps[place].columns] = True
    return mask


def span(steps: Sequence[PlannedComponent]) -> slice:
    """Where the values of consecutive components of the plan lie.

    Args:
        steps: planned components in order.
    """
    return slice(steps[0].columns.start, steps[-1].columns.stop)
