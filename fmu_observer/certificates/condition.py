"""The condition of an observer: whether it exists or is stable, as numbers and in words. A value."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Condition:
    """Answer to: does this observer's existence or stability condition hold for the model and the gains in use?

    Attributes:
        holds: whether it does.
        values: the numbers it was judged by, by name.
        statement: the condition in words, with the symbols of `values`.
        source: equation or theorem.
        warnings: sentences that a user of the observer should read before a run, although it may hold.
    """

    holds: bool
    values: Mapping[str, float]
    statement: str
    source: str
    warnings: tuple[str, ...] = ()

    def explain(self) -> str:
        """One sentence for the user, numbers included."""
        numbers = ", ".join(f"{name} = {value:.4g}" for name, value in self.values.items())
        return f"{'Holds' if self.holds else 'DOES NOT HOLD'}: {self.statement} ({numbers}; {self.source})."
