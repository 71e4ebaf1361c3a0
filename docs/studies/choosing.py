"""Is the observer that `cosim choose` names the right one? On trains that its rules never saw, beside the truth.

``python docs/studies/choosing.py`` chooses for 40 trains and prints the table of docs/guide/choosing_an_observer.md,
with ``--write`` it puts it there; that takes half a minute of CPU a train. ``--first SEED --trains N`` takes others:
the rules were made with those below 5040, and were fixed before any of those from 7004 on was run.

A train is drawn from its seed. What its scenario says is what a user knows: the mass that stands in the papers, the
spacing of the balises, how late and how often their telegrams come, the noise of the odometer, the loss of the network.
What it does not say happens on four hidden seeds: the plant has another mass and another resistance, the track has
slopes, the wheel is worn, it jams and skids. The choice never disturbs a plant, so that nothing is shared but the
observers. All rows run on all hidden seeds: that is the truth. Safe is there what it is in the choice, a row that stays
within the allowance in all runs, but of these four.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite
from pathlib import Path
from time import process_time
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent))

from choosing_trains import Train
from page_tables import write_table

from cosim.choice.benchmark import ObserverBenchmark, benchmark_observers
from cosim.choice.candidates import with_candidate
from cosim.choice.choice import Choice
from cosim.choice.choose import choose
from cosim.choice.ranking import TIE, Row, allowed, ranked
from fmus.tables.numbers import number

PAGE = Path(__file__).parents[1] / "guide" / "choosing_an_observer.md"
FIRST, TRAINS, HIDDEN = 7004, 40, 4
WITHIN, CLOSE = 1.2, 1.5  # factors of the smallest error: what a choice must reach, and what makes an exhibit
THUMBS = ("balise_odometer_ekf", "quasi_lpv_uio:as_published", "takagi_sugeno_cdo:long_gaps", "odometer_reset")
"""Observers that could be taken always."""


def truth_of(train: Train, benchmark: ObserverBenchmark) -> list[Row]:
    """All rows on all hidden seeds, the best first; each believes what it was played with.

    Args:
        train: the train. benchmark: the nominal run with what the user knows; what fails there is none to be chosen.
    """
    failed = benchmark.failed
    fitting = [candidate for name, candidate in benchmark.candidates.items() if name not in failed]
    used: dict[str, dict[str, Any]] = {candidate.name: {} for candidate in fitting}
    failures: dict[str, dict[str, str]] = {candidate.name: {} for candidate in fitting}
    scores: dict[str, Any] = {}
    for hidden in range(HIDDEN):
        scenario = train.truth(hidden)
        for candidate in fitting:
            scenario = with_candidate(scenario, candidate)
        for score in benchmark_observers(scenario, list(used)).scores:
            scores.setdefault(score.name, score)
            if score.used is not None:
                used[score.name][f"hidden {hidden}"] = score.used
            if score.failure is not None:
                failures[score.name][f"hidden {hidden}"] = score.failure
    return ranked([Row(scores[c.name], c, used[c.name], {}, failures[c.name]) for c in fitting])


@dataclass(frozen=True)
class Verdict:
    """Whether an observer was the right one.

    Args:
        label: of the observer. close: whether its error is within `WITHIN` of the smallest, or a tie with it.
        safe: whether it is safe, or nothing is. share: of the allowance that it uses [1]. rms: of the position [m].
    """

    label: str
    close: bool
    safe: bool
    share: float
    rms: float


def verdict(name: str, truth: Sequence[Row], factor: float = WITHIN) -> Verdict:
    """Whether an observer was right.

    Where something is safe its error is held against the smallest error of what is safe; where nothing is, its share of
    the allowance against the smallest.

    Args:
        name: of the observer. truth: all rows on hidden seeds. factor: of the smallest that is still close.
    """
    row = next(row for row in truth if row.candidate.name == name)
    safe = [other for other in truth if other.safe]
    if safe:
        least = min(other.rms for other in safe)
        close = row.rms <= max(factor * least, least + TIE * allowed(truth))
    else:
        least = min(other.share for other in truth)
        close = row.share <= max(factor * least, least + TIE)
    return Verdict(row.label, bool(close), row.safe or not safe, row.share, row.rms)


@dataclass(frozen=True)
class Evaluated:
    """A train with what was chosen and what is true.

    Args:
        train: the train. choice: for it. truth: all rows on hidden seeds. seconds: CPU time of the choice [s].
    """

    train: Train
    choice: Choice
    truth: Sequence[Row]
    seconds: float

    def of(self, label: str) -> Verdict:
        """Of the observer with a label."""
        name = next((row.candidate.name for row in self.truth if row.label == label), None)
        if name is None:  # it failed nominally
            return Verdict(label, False, not any(row.safe for row in self.truth), inf, inf)
        return verdict(name, self.truth)

    @property
    def chosen(self) -> Verdict:
        """Of the choice."""
        return self.of(self.choice.best.label)

    @property
    def nominal(self) -> Verdict:
        """Of what the nominal run alone names."""
        alone = [Row(r.score, r.candidate, _nominal(r.used), {}, _nominal(r.failures)) for r in self.choice.rows]
        return self.of(ranked(alone)[0].label)

    @property
    def best(self) -> Row:
        """The best row in truth: the smallest error of what is safe, or the smallest share."""
        safe = [row for row in self.truth if row.safe]
        return min(safe, key=lambda row: row.rms) if safe else min(self.truth, key=lambda row: row.share)


def _nominal(found: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in found.items() if name == "nominal"}


def evaluated(train: Train) -> Evaluated:
    """Choose for a train, and hold it against the truth.

    Args:
        train: the train.
    """
    begin = process_time()
    choice = choose(train.scenario())
    seconds = process_time() - begin
    return Evaluated(train, choice, truth_of(train, choice.benchmark), seconds)


def row_of(found: Evaluated) -> list[str]:
    """A line of the table.

    Args:
        found: a train with choice and truth.
    """
    train, chosen, nominal, best = found.train, found.chosen, found.nominal, found.best
    odd = [f"late {train.latency:.1f} s"] * (train.latency > 0.0) + [f"{100 * train.missed:.0f} % missed"] * (
        train.missed > 0
    )
    odd += [] if train.loss is None else [f"{100 * train.loss:.0f} % lost"]
    share = number(chosen.share) if isfinite(chosen.share) else "diverges"
    return [
        f"{train.mass / 1e3:.0f} t, {number(train.gap, 2)} s" + "".join(f", {text}" for text in odd),
        f"`{chosen.label}`",
        share,
        number(chosen.rms),
        f"`{best.label}`",
        number(best.share) if isfinite(best.share) else "diverges",
        number(best.rms),
        "yes" if chosen.close else "NO",
        "yes" if chosen.safe else "NO",
        f"`{nominal.label}` " + ("" if nominal.close and nominal.safe else "(NO)"),
        f"{found.seconds:.0f}",
    ]


HEADING = (
    "mass, gap",
    "chosen",
    "of allowance",
    "rms [m]",
    "best in truth",
    "of allowance",
    "rms [m]",
    "close",
    "safe",
    "nominal alone",
    "CPU [s]",
)


def shares(every: Sequence[Evaluated]) -> str:
    """How often each way of choosing is right, as a table.

    Args:
        every: trains with choice and truth.
    """
    ways = {"`cosim choose`": [j.chosen for j in every], "the nominal run alone": [j.nominal for j in every]}
    ways |= {f"always `{label}`": [j.of(label) for j in every] for label in THUMBS}
    lines = ["| way | close to the best | safe where anything is |", "| --- | --- | --- |"]
    for way, found in ways.items():
        close, safe = sum(v.close for v in found), sum(v.safe for v in found)
        lines.append(f"| {way} | {close} of {len(found)} | {safe} of {len(found)} |")
    return "\n".join(lines)


def exhibits(every: Sequence[Evaluated]) -> list[str]:
    """Labels of the rows that are within `CLOSE` of the best, or tie with it, on no train.

    Args:
        every: trains with choice and truth.
    """
    labels = dict.fromkeys(row.label for found in every for row in found.truth)
    for found in every:
        for row in found.truth:
            if row.label in labels and verdict(row.candidate.name, found.truth, CLOSE).close and _useful(row, found):
                del labels[row.label]
    return list(labels)


def _useful(row: Row, found: Evaluated) -> bool:
    """Whether it is safe, where anything is."""
    return row.safe or not any(other.safe for other in found.truth)


def table(every: Sequence[Evaluated]) -> str:
    """The table of trains.

    Args:
        every: trains with choice and truth.
    """
    lines = ["| " + " | ".join(HEADING) + " |", "|" + " --- |" * len(HEADING)]
    return "\n".join([*lines, *("| " + " | ".join(row_of(found)) + " |" for found in every)])


def main(words: Sequence[str]) -> None:
    """Choose for trains, print the tables; with ``--write`` put them on the page.

    Args:
        words: of the command line.
    """
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=FIRST)
    parser.add_argument("--trains", type=int, default=TRAINS)
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args(words)
    every = []
    for seed in range(options.first, options.first + options.trains):
        every.append(evaluated(Train.drawn(seed)))
        print("| " + " | ".join(row_of(every[-1])) + " |", flush=True)
    names = ", ".join(f"`{label}`" for label in exhibits(every))
    parts = {"choices": table(every), "choice_shares": shares(every), "exhibits": f"{names}."}
    for name, text in parts.items():
        print(f"\n{text}")
        if options.write:
            write_table(PAGE, name, text)


if __name__ == "__main__":
    main(sys.argv[1:])
