"""Finding: what is known of an observer's stability or error, as one value. Conditions of a finding are findings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from math import inf, isfinite, isinf, isnan, nan
from typing import Any, Literal

from fmu_observer.certificates.limit_search import LimitSearch

Kind = Literal["as printed", "sufficient", "exact", "simulated", "not found up to"]


@dataclass(frozen=True)
class Finding:  # noqa: PLW1641 - the data class makes its hash
    """Answer to one question about an observer with its gains: how long may a gap be, does a condition hold.

    Attributes:
        what: quantity or condition. value: in its unit; nan where only `holds` is known.
        kind: ``as printed`` in a source, ``sufficient`` (it may do better), ``exact``, ``simulated``, or ``not found up
            to``: `value` is the end of a search that found no limit.
        source: theorem, equations that were used with what they leave out, or runs.
        holds: whether what is demanded, or the condition, holds; None where nothing is demanded.
        statement: in words, with the symbols of `conditions`. conditions: numbers and premises that it rests on.
        demand: value that it was held against, in its unit; None for none.
        explanation: whole sentences for the user, where `explain` is to say more than statement and numbers.
        lyapunov_matrix: P of the function ``e' P e`` that proves it, rows of shape (n, n); empty where there is none.
        search: runs that are to find `value`, nan until then.
    """

    what: str
    value: float
    unit: str
    kind: Kind
    source: str
    holds: bool | None = None
    statement: str = ""
    conditions: tuple[Finding, ...] = ()
    demand: float | None = None
    explanation: str = ""
    lyapunov_matrix: tuple[tuple[float, ...], ...] = ()
    search: LimitSearch | None = field(default=None, compare=False, repr=False)

    def __eq__(self, other: object) -> bool:
        """Whether all is equal; two values that are not known are."""
        return isinstance(other, Finding) and self._compared == other._compared

    @property
    def _compared(self) -> tuple[Any, ...]:
        return tuple(getattr(self, entry.name) for entry in fields(self) if entry.compare)

    @property
    def limit(self) -> float:
        """Value from which on it is lost; inf where a search found none."""
        return inf if self.kind == "not found up to" else self.value

    @property
    def remarks(self) -> tuple[str, ...]:
        """Statements of the conditions."""
        return tuple(condition.statement for condition in self.conditions if condition.statement)

    @property
    def numbers(self) -> dict[str, float]:
        """Values of the conditions, by what they are of."""
        return {condition.what: condition.value for condition in self.conditions}

    def condition(self, what: str) -> Finding:
        """The condition of that name.

        Raises:
            KeyError: there is none.
        """
        return {condition.what: condition for condition in self.conditions}[what]

    def also(self, *conditions: Finding) -> Finding:
        """The same with further conditions; it holds where they do not fail.

        Args:
            conditions: to be added.
        """
        failed = any(condition.holds is False for condition in conditions)
        return replace(self, holds=self.holds and not failed, conditions=(*self.conditions, *conditions))

    def explain(self) -> str:
        """One to three plain sentences for the user, numbers included."""
        if self.explanation:
            return self.explanation
        numbers = ", ".join(f"{c.what} = {c.value:.4g}" for c in self.conditions if not isnan(c.value))
        return f"{'Holds' if self.holds else 'DOES NOT HOLD'}: {self.statement} ({numbers}; {self.source})."

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> Finding:
        """A finding from its fields as `dataclasses.asdict` gives them, also by way of JSON.

        Args:
            data: fields by name.
        """
        conditions = tuple(map(cls.of, data["conditions"]))
        matrix = tuple(map(tuple, data["lyapunov_matrix"]))
        value = nan if isnan(data["value"]) else data["value"]  # the one that equals itself in comparisons
        return cls(**{**data, "value": value, "conditions": conditions, "lyapunov_matrix": matrix})

    def to_dict(self) -> dict[str, Any]:
        """Plain data: infinite and missing numbers as None, what is empty left out."""
        data: dict[str, Any] = {"what": self.what, "value": self.value if isfinite(self.value) else None}
        data |= {"unbounded": True} if isinf(self.value) else {}
        data |= {"unit": self.unit, "holds": self.holds, "kind": self.kind, "source": self.source}
        further = {
            "demand": self.demand,
            "statement": self.statement,
            "explanation": self.explanation,
            "conditions": [condition.to_dict() for condition in self.conditions],
            "lyapunov_matrix": [list(row) for row in self.lyapunov_matrix],
        }
        return data | {name: value for name, value in further.items() if value not in (None, "", [])}


def gap_numbers(gap: float, longest: float, lipschitz: float) -> dict[str, float]:
    """Numbers of a condition that a gap keeps, by name with unit.

    Args:
        gap: between samples [s]. longest: that the condition allows [s]. lipschitz: constant of the model [1/s].
    """
    return {"gap [s]": gap, "longest_gap [s]": longest, "lipschitz [1/s]": lipschitz}


def condition_found(
    holds: bool,
    numbers: Mapping[str, float],
    statement: str,
    source: str,
    kind: Kind = "sufficient",
) -> Finding:
    """Whether a condition holds for the model and the gains in use.

    Args:
        holds: whether it does. numbers: it was evaluated by, by name and unit: ``abscissa [1/s]``, ``rank``.
        statement: the condition in words, with the names of the numbers. source: equation or theorem.
        kind: ``exact`` where it is necessary too.
    """
    parts = []
    for key, value in numbers.items():
        name, _, unit = key.partition(" [")
        parts.append(Finding(name, float(value), unit.rstrip("]") or "1", "exact", ""))
    return Finding("existence and stability", nan, "1", kind, source, bool(holds), statement, tuple(parts))


def remark(statement: str) -> Finding:
    """What else is to be known of a finding, in words.

    Args:
        statement: a clause.
    """
    return Finding("remark", nan, "1", "exact", "", statement=statement)


def as_printed(what: str, value: float, statement: str, source: str, unit: str = "s") -> Finding:
    """A bound of a thesis: sufficient at best.

    Args:
        what: is bounded. value: of the bound. statement: what it says, in symbols. source: thesis and equation.
        unit: of the value.
    """
    return Finding(what, value, unit, "as printed", source, statement=statement)


def limit_found(
    what: str, limit: float, searched_to: float, source: str, *, shortest: float = 0.0, kind: Kind = "exact"
) -> Finding:
    """First value [s] at which something is lost.

    Args:
        what: is limited. limit: inf where none was found. searched_to: how far was searched, inf where what is found
            holds without end. source: the test, in words. shortest: value that was tried, for a limit of 0.
        kind: of a limit that was found.
    """
    if isinf(limit) and isfinite(searched_to):
        return Finding(what, searched_to, "s", "not found up to", source)
    text = f"lost at {shortest:.3g} s already, the shortest that was tried" if limit == 0.0 and shortest > 0.0 else ""
    return Finding(what, min(limit, searched_to), "s", kind, source, statement=text)


def to_simulate(search: LimitSearch, what: str) -> Finding:
    """A limit that runs are to find.

    Args:
        search: the runs. what: is limited.
    """
    source = "first failure of runs without noise beside its own model"
    return Finding(what, nan, "s", "simulated", source, search=search)
