"""What became of an expectation: plain data and a table. Standard library only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from math import inf, isfinite, isinf, isnan, nan
from typing import Any

from fmus.tables.numbers import number
from fmus.tables.table import Table, name_column, text_column

_LEAST = 1e-12
"""A margin that is broken by rounding only."""


@dataclass(frozen=True, slots=True)
class Evaluated:
    """One thing that was expected, and what was measured.

    Args:
        name: what was expected, in words. check: kind of the expectation, as in the scenario.
        passed: whether it is met.
        measured: what was measured; NaN where nothing was.
        limit: what it was held against.
        unit: SI unit of both; ``s`` for instants, ``1`` for counts.
        when: when the worst was measured, or when what is not allowed began [s]; NaN where no instant says anything.
        text: one line: measured, limit, when, or why nothing was decided.
        number: which expectation of the scenario, from 1; one may be judged in several parts.
        margin: how far from being broken, in parts of the limit: below 0 where it is not met; minus infinite where
            something is no finite number, NaN where nothing was measured.
    """

    name: str
    check: str
    passed: bool
    measured: float = nan
    limit: float = nan
    unit: str = "1"
    when: float = nan
    text: str = ""
    number: int = 1
    margin: float = nan

    def to_data(self) -> dict[str, Any]:
        """Plain data for the summary of a run."""
        return asdict(self)

    @classmethod
    def from_data(cls, data: Mapping[str, Any]) -> Evaluated:
        """From the summary of a run, also from a file, where NaN has become None.

        Args:
            data: plain data of a judgement.
        """
        values: dict[str, Any] = {field.name: data[field.name] for field in fields(cls) if field.name in data}
        return cls(**(values | {key: nan for key, value in values.items() if value is None}))


def with_margin(evaluated: Evaluated) -> Evaluated:
    """With the margin that follows from what was measured and the limit, where the kind has stated none.

    Args:
        evaluated: of any kind.
    """
    measured, limit = evaluated.measured, evaluated.limit
    if isnan(measured) or not isnan(evaluated.margin):
        return evaluated
    distance = inf if isinf(measured) or isinf(limit) else abs(measured - limit) / (abs(limit) or 1.0)
    return replace(evaluated, margin=distance if evaluated.passed else -max(distance, _LEAST))


_COLUMNS = (
    name_column("verdict", "Verdict"),
    text_column("name", "Expected"),
    text_column("text", "Measured", "What was measured, the limit and when; or why nothing was decided"),
)


def evaluated_table(evaluated: Sequence[Evaluated]) -> Table:
    """All expectations with what was measured, what is not met first.

    Args:
        evaluated: of the run.
    """
    unmet = [j for j in evaluated if not j.passed]
    everything = "The expectation is met:" if len(evaluated) == 1 else f"All {len(evaluated)} expectations met:"
    head = f"{len(unmet)} of {len(evaluated)} expectations not met:" if unmet else everything
    rows = [["met" if j.passed else "not met", j.name, j.text] for j in sorted(evaluated, key=lambda j: j.passed)]
    return Table("expectations", _COLUMNS, rows, head)


def with_unit(value: float, unit: str, digits: int = 4) -> str:
    """A measured number with its unit, without one for pure numbers.

    Args:
        value: number in the unit. digits: significant ones.
    """
    return _unit_behind(number(value, digits), unit)


def written(value: float, unit: str = "") -> str:
    """A number as it was given, a limit or an instant, with its unit.

    Args:
        value: number in the unit.
    """
    return _unit_behind(f"{value:.6g}", unit)


def at(when: float, what: str = "at") -> str:
    """When, in brackets; empty where no instant is known.

    Args:
        when: instant [s]. what: that happened then.
    """
    return f" ({what} {written(when)} s)" if isfinite(when) else ""


def _unit_behind(text: str, unit: str) -> str:
    return text if unit in ("", "1") else f"{text} {unit}"
