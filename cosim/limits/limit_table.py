"""The limits of an observer as rows and as a table: every printed bound beside the exact and the practical limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isinf

from cosim.limits.search import MEMBERS, practical_limit, reach
from fmu_observer.certificates.observer_limits import Limit, Trial
from fmus.text_table import text_table


@dataclass(frozen=True)
class LimitRow:
    """One limit with what became of it.

    Attributes:
        quantity: what is limited. unit: of the values. printed: bounds, each with its statement and source.
        exact: of the error equations, None where no test is known. exact_test: what it looks at.
        looked: shortest and longest value that the exact test looked at; 0 and inf where it holds without end.
        practical: found by simulation, None where nothing was run; inf where all that was tried was survived, 0 where
            nothing was.
        searched: shortest and longest value of the simulation, empty where nothing was run.
    """

    quantity: str
    unit: str
    printed: tuple[tuple[float, str, str], ...]
    exact: float | None
    exact_test: str
    looked: tuple[float, float]
    practical: float | None
    searched: tuple[float, float] | tuple[()]


def limit_rows(limits: Sequence[Limit], simulate: bool = True, members: int = MEMBERS) -> list[LimitRow]:
    """Limits with their practical values.

    Args:
        limits: as an observer's `limits` gives them. simulate: whether trials are run. members: see `practical_limit`.
    """
    return [_row(limit, limit.trial if simulate else None, members) for limit in limits]


def limit_text(observer: str, rows: Sequence[LimitRow]) -> str:
    """The table of an observer, with the statements of its bounds below it.

    Args:
        observer: name. rows: as `limit_rows` gives them.
    """
    cells = [["limit", "printed", "exact", "practical"]]
    notes = []
    for row in rows:
        bounds = [_number(value, row.unit) for value, _, _ in row.printed] or ["-"]
        exact, practical = _number(row.exact, row.unit, row.looked), _number(row.practical, row.unit, row.searched)
        cells.append([row.quantity, bounds[0], exact, practical])
        cells.extend(["", bound, "", ""] for bound in bounds[1:])
        notes += [f"{_number(value, row.unit)}: {statement} ({source})" for value, statement, source in row.printed]
        if row.exact is not None:
            notes.append(f"exact, {row.quantity}: {row.exact_test}")
        if row.searched:
            low, high = row.searched
            notes.append(
                f"practical, {row.quantity}: first failure of runs without noise, {low:g} to {high:g} {row.unit}"
            )
    return "\n".join([f"Limits of {observer}", *text_table(cells, heading=True), "", *notes])


def _row(limit: Limit, trial: Trial | None, members: int) -> LimitRow:
    return LimitRow(
        quantity=limit.quantity,
        unit=limit.unit,
        printed=tuple((bound.value, bound.statement, bound.source) for bound in limit.printed),
        exact=limit.exact,
        exact_test=limit.exact_test,
        looked=(limit.tried, limit.searched_to),
        practical=None if trial is None else practical_limit(trial, members),
        searched=() if trial is None else reach(trial),
    )


def _number(value: float | None, unit: str, searched: tuple[float, float] | tuple[()] = ()) -> str:
    """A limit; the end of a search is none, and is shown as what the limit lies beyond."""
    shortest, longest = searched or (0.0, inf)
    if value is None:
        return "-"
    if isinf(value):
        return "none" if isinf(longest) else f"> {longest:.3g} {unit}"
    if value == 0.0 and shortest > 0.0:
        return f"< {shortest:.3g} {unit}"
    return f"{value:.3g} {unit}"
