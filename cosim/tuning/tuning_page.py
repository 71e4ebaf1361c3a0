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
            Section("What was found", [*tuning.parts()]),
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
    gain, kind = tuning.gain, "validation" if tuning.validated else "training"
    text = f"Cost {number(_mean(tuning, 0))} before, {number(_mean(tuning, 1))} after, with the {kind} seeds"
    text += f": a gain of {gain.text()}."
    if tuning.interrupted:
        return PageVerdict(f"{text} The search was interrupted.", "doubt")
    if not tuning.validated:
        return PageVerdict(f"{text} No seed validates it: what was learnt may be luck.", "doubt")
    if not gain.low > 0.0:
        return PageVerdict(f"{text} This does not show that the scenario has become better: it may be luck.", "doubt")
    return PageVerdict(text, "good")


def _mean(tuning: Tuning, after: int) -> float:
    pairs = (tuning.validated_before, tuning.validated_after) if tuning.validated else (tuning.before, tuning.after)
    return float(np.mean(pairs[after]))


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
