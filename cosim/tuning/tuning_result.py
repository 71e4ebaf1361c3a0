"""What tuning leaves: the best candidate of each search, costs with training and validation seeds, warnings, as text
and plain data.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cosim.statistics.intervals import mean_of
from cosim.statistics.spread import Spread
from fmus.tables.numbers import number
from fmus.tables.table import Column, Parts, Readable, Table, name_column

if TYPE_CHECKING:
    from cosim.simulation.scenario import Scenario


_COST_COLUMNS = (
    name_column("seeds", "seeds"),
    Column("count", "number", meaning="How many seeds"),
    Column("before", "before", meaning="Mean cost with the values before, with its 95 % interval", write=Spread.text),
    Column("after", "after", meaning="Mean cost of the best candidate, with its 95 % interval", write=Spread.text),
)
_VALUE_COLUMNS = (
    name_column("parameter", "parameter"),
    Column("before", "before", meaning="Value before"),
    Column("after", "after", meaning="Value of the best candidate"),
)


@dataclass(frozen=True)
class Searched:
    """One search.

    Args:
        seed: of the optimiser. best: values by name. costs: best cost after each iteration, with the training seeds.
        evaluations: candidates asked for up to each iteration.
    """

    seed: int
    best: Mapping[str, float]
    costs: Sequence[float]
    evaluations: Sequence[int]


@dataclass(frozen=True)
class Tuning(Readable):
    """What came out.

    Args:
        scenario: with the best values. method: name of the optimiser. cost: in words.
        searches: one for each seed of the optimiser. start: values before, by name. best: values after.
        seeds, validated: training and validation seeds.
        before, after: costs with the training seeds, one each; of the scenario as it was, and of the best candidate.
        validated_before, validated_after: likewise with the validation seeds.
        runs: made in all. how: in what the candidates were run, in words.
        warnings: what the user should know. fixed: parameters that were held, and why.
        interrupted: whether somebody stopped it.
    """

    scenario: Scenario
    method: str
    cost: str
    searches: Sequence[Searched]
    start: Mapping[str, float]
    best: Mapping[str, float]
    seeds: Sequence[int]
    validated: Sequence[int]
    before: Sequence[float]
    after: Sequence[float]
    validated_before: Sequence[float]
    validated_after: Sequence[float]
    runs: int
    how: str
    warnings: Sequence[str] = ()
    fixed: Mapping[str, str] = ()  # type: ignore[assignment] # replaced by `tune`
    interrupted: bool = False

    @property
    def gain(self) -> Spread:
        """Cost before minus after with the validation seeds, pair by pair; of the training seeds without them."""
        pairs = zip(self.validated_before, self.validated_after, strict=True) if self.validated else None
        pairs = pairs or zip(self.before, self.after, strict=True)
        return mean_of([float(b) - float(a) for b, a in pairs])

    def costs(self) -> Table:
        """A row for each kind of seeds: costs before and after, with 95 % intervals."""
        rows = [["training", len(self.seeds), mean_of(self.before), mean_of(self.after)]]
        if self.validated:
            rows.append(
                ["validation", len(self.validated), mean_of(self.validated_before), mean_of(self.validated_after)]
            )
        return Table("costs", _COST_COLUMNS, rows, f"{self.method}: {self.cost}")

    @property
    def shown_better(self) -> bool:
        """Whether the validation seeds show a gain."""
        return bool(self.validated) and self.gain.low > 0.0

    @property
    def verdict(self) -> str:
        """Whether seeds that no search has seen show a gain, in a sentence or two."""
        kind = "validation" if self.validated else "training"
        costs = (self.validated_before, self.validated_after) if self.validated else (self.before, self.after)
        before, after = (number(float(np.mean(values))) for values in costs)
        text = f"Cost {before} before, {after} after, with the {kind} seeds: a gain of {self.gain.text()}."
        if self.interrupted:
            return f"{text} The search was interrupted."
        if not self.validated:
            return f"{text} No seed validates it: what was learnt may be luck."
        return text if self.shown_better else f"{text} This does not show that it has become better: it may be luck."

    def parts(self) -> Parts:
        """Costs before and after, spread over searches, values, warnings, verdict."""
        return [*self.details(), "\n".join(f"warning: {text}" for text in self.warnings), self.verdict]

    def details(self) -> Parts:
        """The same without warnings and verdict."""
        values = [[name, self.start.get(name), value] for name, value in self.best.items()]
        lines = [f"held: {name}, {why}" for name, why in self.fixed.items()]
        remarks = "\n".join([*lines, f"{self.runs} runs, {self.how}."])
        return [self.costs(), self._spread(), Table("parameters", _VALUE_COLUMNS, values), remarks]

    def _spread(self) -> str:
        """How far the searches end apart; empty for one search."""
        if len(self.searches) < 2:
            return ""
        finals = np.array([search.costs[-1] for search in self.searches])
        low, middle, high = np.percentile(finals, (25, 50, 75))
        return (
            f"{len(finals)} searches end at {number(middle)} in the median, quartiles {number(low)} and "
            f"{number(high)}, best {number(finals.min())}."
        )

    def to_data(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "method": self.method,
            "cost": self.cost,
            "best": dict(self.best),
            "start": dict(self.start),
            "fixed": dict(self.fixed),
            "seeds": list(self.seeds),
            "before": list(self.before),
            "after": list(self.after),
            "validated": list(self.validated),
            "validated_before": list(self.validated_before),
            "validated_after": list(self.validated_after),
            "searches": [
                {"seed": s.seed, "best": dict(s.best), "costs": list(s.costs), "evaluations": list(s.evaluations)}
                for s in self.searches
            ],
            "runs": self.runs,
            "how": self.how,
            "warnings": list(self.warnings),
            "interrupted": self.interrupted,
        }
