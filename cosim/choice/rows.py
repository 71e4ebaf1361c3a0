"""Rows of a choice from the runs that there are; presets that are the same here are one row."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from dataclasses import replace

from cosim.choice.allowance import UsedAllowance
from cosim.choice.benchmark import ObserverBenchmark
from cosim.choice.ranking import NOTHING, Row
from cosim.run.checked_observers import presets_of_other_plants


def row_of(where: str, name: str, found: Sequence[ObserverBenchmark]) -> Row:
    """An observer over the runs in which it took part.

    Args:
        where: the scenario, for remarks. name: of the observer. found: the runs, the nominal one first.
    """
    used: dict[str, UsedAllowance] = {}
    harder: dict[str, UsedAllowance] = {}
    failures: dict[str, str] = {}
    for benchmark in found:
        run = benchmark.disturbance
        score = next((score for score in benchmark.scores if score.name == name), None)
        if score is None or (score.used is None and benchmark is found[0]):
            continue
        (harder if run.harder else used)[run.name] = score.used or NOTHING
        if score.failure is not None and not run.harder:
            failures[run.name] = score.failure
    nominal = found[0]
    score = next(score for score in nominal.scores if score.name == name)
    candidate = nominal.candidates[name]
    remarks = presets_of_other_plants({name: candidate.table}, where) if used else ()
    return Row(score, candidate, used, harder, failures, remarks)


def merged(rows: Iterable[Row]) -> list[Row]:
    """Presets of one observer that are the same here as one row, which names the others: one that was not made for
    another train where there is one, else the first.

    Args:
        rows: of all observers, after the runs that all have.
    """
    groups: dict[Hashable, list[Row]] = {}
    for row in rows:
        groups.setdefault(_numbers(row), []).append(row)
    return [_one(group) for group in groups.values()]


def _numbers(row: Row) -> Hashable:
    """What presets that are the same have in common; a row without numbers has it with none."""
    shipped = row.candidate.origin == "defaults" and bool(row.used) and not row.failures
    return (row.candidate.model, *row.used.items()) if shipped else row.score.name


def _one(group: Sequence[Row]) -> Row:
    first = min(group, key=lambda row: bool(row.remarks))
    return replace(first, also=[row.label for row in group if row is not first])
