"""The page of a tuning: whether the scenario became better and how surely, convergence of each search, parameters
before and after, costs of every seed. Touches no file.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from cosim.report.live.live_page import Card, LivePage, PageCurve, PagePanel, PageRecording, PageVerdict, Rows, Section
from fmus.tables.numbers import number
from fmus.tables.table import Column, Table, name_column

if TYPE_CHECKING:
    from cosim.tuning.tuning_result import Tuning

_CONVERGENCE = "Best cost"


def tuning_page(tuning: Tuning) -> LivePage:
    """What the page of a tuning shows.

    Args:
        tuning: what was found.
    """
    before = float(np.mean(tuning.before))
    recordings = [_search(s.evaluations, s.costs, f"search {s.seed}") for s in tuning.searches if len(s.costs)]
    ends = [x for recording in recordings for x in (recording.x[0], recording.x[-1])]
    if ends:
        level = PageCurve("before", np.full(2, before), "1", look="wanted")
        recordings.append(PageRecording("before", np.array([min(ends), max(ends)]), [level], "candidates", "1"))
    is_positive = min([before, *(cost for s in tuning.searches for cost in s.costs)]) > 0.0
    return LivePage(
        title=f"Tuning by {tuning.method}",
        verdict=_verdict(tuning),
        cards=_cards(tuning),
        lead=tuning.cost,
        recordings=recordings,
        panels=[PagePanel(_CONVERGENCE, [_CONVERGENCE, "before"], log=is_positive)],
        sections=[
            Section("Warnings", [[*tuning.warnings]], mood="doubt"),
            Section("What was found", [*tuning.details()]),
            Section("Parameters of each search", [Rows(_parameters(tuning))]),
            Section("Costs of every seed", [Rows(_seeds(tuning))]),
        ],
    )


def _search(evaluations: Sequence[int], costs: Sequence[float], label: str) -> PageRecording:
    """The best cost so far over the candidates that were asked for."""
    curve = PageCurve(_CONVERGENCE, np.asarray(costs, dtype=float), "1", held=True)
    return PageRecording(label, np.asarray(evaluations, dtype=float), [curve], "candidates", "1")


def _verdict(tuning: Tuning) -> PageVerdict:
    """Whether seeds that no search has seen show a gain."""
    return PageVerdict(tuning.verdict, "good" if tuning.shown_better and not tuning.interrupted else "doubt")


def _cards(tuning: Tuning) -> list[Card]:
    finals = [s.costs[-1] for s in tuning.searches if len(s.costs)]
    cards: list[Card] = [
        ("Runs", str(tuning.runs), tuning.how, ""),
        (
            "Seeds",
            f"{len(tuning.seeds)} training",
            f"{len(tuning.validated)} validation",
            "" if tuning.validated else "doubt",
        ),
    ]
    if finals:
        spread = f"best {number(min(finals))}, worst {number(max(finals))}"
        cards.append(("Searches", str(len(finals)), spread, ""))
    return cards


def _parameters(tuning: Tuning) -> Table:
    """Before, and what each search ended with, the best first."""
    names = list(tuning.best)
    columns = [
        name_column("what", "Search"),
        *(Column(n, n, digits=5) for n in names),
        Column("cost", "Cost", digits=4),
    ]
    ordered = sorted((s for s in tuning.searches if len(s.costs)), key=lambda s: s.costs[-1])
    rows = [["before", *(tuning.start.get(n) for n in names), float(np.mean(tuning.before))]]
    rows += [[f"search {s.seed}", *(s.best.get(n) for n in names), float(s.costs[-1])] for s in ordered]
    return Table("parameters", columns, rows)


def _seeds(tuning: Tuning) -> Table:
    """Costs of each seed before and after."""
    columns = [name_column("seed", "Seed"), Column("before", "Before", digits=4), Column("after", "After", digits=4)]
    kinds = [
        ("training", tuning.seeds, tuning.before, tuning.after),
        ("validation", tuning.validated, tuning.validated_before, tuning.validated_after),
    ]
    rows = [
        [f"{kind} {seed}", costs[0], costs[1]]
        for kind, seeds, *found in kinds
        for seed, *costs in zip(seeds, *found, strict=False)
    ]
    return Table("seeds", columns, rows)
