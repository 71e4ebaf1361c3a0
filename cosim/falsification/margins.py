"""What is taken of a run: how far each expectation is from being broken."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isnan
from typing import Any

from cosim.expectations.evaluated import Evaluated
from cosim.run.outcome import Outcome

_FAR = 1e9
"""A margin of what is no finite number: JSON has no infinite ones."""


def expectations_of(outcome: Outcome) -> list[dict[str, Any]]:
    """What became of the expectations, as plain data; nothing of a run that ended early.

    Args:
        outcome: of a run.
    """
    found = [] if outcome.failure is not None else outcome.expectations
    return [each.to_data() | {"margin": _finite(each.margin)} for each in found]


@dataclass(frozen=True)
class Margin:
    """How far a run is from breaking an expectation.

    Args:
        value: of the one that is nearest to it, or broken most, in parts of its limit; below 0 it is broken, infinite
            where the run shows none. evaluated: what became of that one; None where the run shows none.
    """

    value: float = inf
    evaluated: Evaluated | None = None

    @property
    def broken(self) -> bool:
        """Whether an expectation is not met."""
        return self.value < 0.0


def margin_of(row: Sequence[Mapping[str, Any]] | None, which: int | None) -> Margin:
    """The smallest margin of a run.

    Args:
        row: as `expectations_of` gives it, or None of a run that failed. which: expectation of the scenario, from 1;
            None for all.
    """
    found = [Evaluated.from_data(data) for data in row or ()]
    known = [each for each in found if which in (None, each.number) and not isnan(each.margin)]
    worst = min(known, key=lambda each: each.margin, default=None)
    return Margin() if worst is None else Margin(worst.margin, worst)


def _finite(margin: float) -> float:
    return margin if isnan(margin) else min(max(margin, -_FAR), _FAR)
