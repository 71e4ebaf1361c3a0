"""The choice of the algorithm before the run: from what is asked for, and from the loops of the coupling."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from cosim.components.component import Component
from cosim.coupling.feedthrough import AlgebraicLoop
from cosim.coupling.graph import Group
from cosim.errors import CouplingError

Wanted = Literal["auto", "gauss-seidel", "jacobi", "iterate"]
_BREAK_IT = (
    "break the loop with a component that holds a state or a sample (for instance a sampled sensor), or merge "
    "the components"
)


@dataclass(frozen=True)
class AlgorithmChoice:
    """What steps the components, and why.

    Args:
        algorithm: ``gauss-seidel``, ``jacobi`` or ``iterate``.
        reason: one sentence.
        iterated: names of the components of each loop that is iterated, in execution order.
        groups: names of the strongly connected groups, in execution order.
        notes: what else the user should know, sentences.
    """

    algorithm: str = "gauss-seidel"
    reason: str = "Nothing else was asked for."
    iterated: tuple[tuple[str, ...], ...] = ()
    groups: tuple[tuple[str, ...], ...] = ()
    notes: tuple[str, ...] = ()

    def summary(self) -> dict[str, Any]:
        """Plain data for the summary of a run."""
        return {"reason": self.reason, "groups": [list(group) for group in self.groups]}


def choose_algorithm(wanted: Wanted, groups: Sequence[Group], components: Mapping[str, Component]) -> AlgorithmChoice:
    """The algorithm of a run; needs descriptions only.

    Args:
        wanted: ``auto`` iterates algebraic loops and steps everything else by Gauss-Seidel; ``iterate`` iterates all
            loops.
        groups: from `execution_groups`. components: by name.

    Raises:
        CouplingError: an algebraic loop that the algorithm asked for does not solve, or components in a loop to be
        iterated that
            cannot save their state.
    """
    algebraic = [loop for group in groups for loop in group.algebraic]
    names = tuple(group.names for group in groups)
    notes = tuple(_possible(loop) for group in groups for loop in group.possible) if wanted != "iterate" else ()
    if wanted in ("gauss-seidel", "jacobi"):
        if algebraic:
            raise CouplingError(
                f"master.algorithm = '{wanted}' does not solve the algebraic loop {algebraic[0]}. Use 'auto' or "
                f"'iterate', or "
                f"{_BREAK_IT}."
            )
        return AlgorithmChoice(wanted, "It was asked for.", (), names, notes)
    if wanted == "auto":
        return _automatic(algebraic, groups, components, names, notes)
    loops = tuple(group.names for group in groups if group.loop)
    _demand_states(loops, algebraic, components)
    reason = "It was asked for." if loops else "It was asked for; there is no loop to iterate, so this is Gauss-Seidel."
    return AlgorithmChoice("iterate", reason, loops, names, notes)


def _automatic(
    algebraic: Sequence[AlgebraicLoop],
    groups: Sequence[Group],
    components: Mapping[str, Component],
    names: tuple[tuple[str, ...], ...],
    notes: tuple[str, ...],
) -> AlgorithmChoice:
    if algebraic:
        knots = tuple(knot for group in groups for knot in group.knots)
        _demand_states(knots, algebraic, components)
        others = "" if len(algebraic) == 1 else f" and {len(algebraic) - 1} more"
        reason = f"There is an algebraic loop, {algebraic[0]}{others}; the rest is stepped by Gauss-Seidel."
        return AlgorithmChoice("iterate", reason, knots, names, notes)
    if any(group.loop for group in groups):
        reason = "There are loops, and each holds a state somewhere: what is fed back is held over a step."
    else:
        reason = "There is no loop: every component is stepped after all its sources."
    return AlgorithmChoice("gauss-seidel", reason, (), names, notes)


def _demand_states(
    loops: Sequence[Sequence[str]], algebraic: Sequence[AlgebraicLoop], components: Mapping[str, Component]
) -> None:
    for loop in loops:
        stateless = [name for name in loop if not components[name].can_save]
        if not stateless:
            continue
        path = next(
            (f"the algebraic loop {a}" for a in algebraic if set(a.components) <= set(loop)),
            f"the loop of {', '.join(loop)}",
        )
        remedy = (
            _BREAK_IT if any(set(a.components) <= set(loop) for a in algebraic) else "use master.algorithm = 'auto'"
        )
        raise CouplingError(
            f"To iterate {path}, its components must save and restore their state (canGetAndSetFMUState), and these "
            f"cannot: "
            f"{', '.join(stateless)}. Use FMUs that can, or {remedy}."
        )


def _possible(loop: AlgebraicLoop) -> str:
    return (
        f"Possible algebraic loop {loop}: an FMU in it does not say what its outputs depend on. It is stepped as if a "
        f"state were "
        "in between; if there is none, master.algorithm = 'iterate' solves it."
    )
