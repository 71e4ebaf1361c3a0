"""The answer to which observer: rows in order and in groups, as text, data, lines for a scenario, and a page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from typing import Any

import tomli_w

from cosim.choice.allowance import Allowance
from cosim.choice.benchmark import ObserverBenchmark
from cosim.choice.candidates import named_receivers, with_candidate
from cosim.choice.disturbances import Disturbance
from cosim.choice.playback import connection
from cosim.choice.ranking import Row
from cosim.errors import RunError
from cosim.report.page.observer_page import Answer, write_benchmark
from cosim.report.page.picture_files import Pictures
from cosim.simulation.scenario import Scenario
from fmus.tables.numbers import number
from fmus.tables.plain_data import jsonable
from fmus.tables.table import Column, Parts, Readable, Table, error_column, name_column, text_column

INTERRUPTED = "interrupted"
"""Why fewer runs count where somebody wanted it so."""
_NOMINAL = " (by the nominal run alone, which mostly names a wrong one)"
_UNCORRECTED = (
    ". No telegram reached an observer in this run: the allowance counts from its start, and balises were not tried"
)
PLAIN = "odometer_reset"
"""What every observer has to beat."""
_DISTURBED = ("odometer", "effort")
"""Inputs of observers that disturbances act on, by their usual names."""
_SHOWN = 8
"""How many of the best a page draws, beside the plain odometer."""
_CUT = 12
"""How many rows of a group a terminal shows; all stand on the page and in the data."""
_SHARE = Column("share", "of allowance", "%", "Largest share of the allowance in all runs that count", factor=100.0)
_WORST = text_column("worst", "worst run")
_RUNS = Column("runs", "runs", "", "How many runs count for it")
_RMS = error_column("rms_position_error", "rms p", "m", "Position error over all runs that count")
_SPEED = error_column("rms_speed_error", "rms v", "m/s", "Speed error of the nominal run")
_COST = Column("cost", "cost", "us/step", "Time in the observer per communication step", factor=1e6)
_BECAUSE = text_column("because", "because")
_NAME = name_column("observer", "observer")


@dataclass(frozen=True)
class Choice(Readable):
    """Observers beside several disturbed runs of one plant.

    Args:
        scenario: that was played. rows: of the observers, the best first. benchmark: of the nominal run.
        disturbances: of the runs that count and of the harder ones. allowance: what a position may be off.
        stopped: why fewer runs count, `INTERRUPTED` or what failed; empty where all do.
    """

    scenario: Scenario
    rows: Sequence[Row]
    benchmark: ObserverBenchmark
    disturbances: Sequence[Disturbance]
    allowance: Allowance
    stopped: str = ""

    @property
    def found(self) -> bool:
        """Whether any observer came through."""
        return bool(self.rows) and isfinite(self.rows[0].share)

    @property
    def best(self) -> Row:
        """The observer to use, or the least bad one.

        Raises:
            RunError: none came through.
        """
        if not self.found:
            raise RunError(f"{self.scenario.where}: {self.answer}")
        return self.rows[0]

    @property
    def answer(self) -> str:
        """The answer in a line."""
        if not self.found:
            return "no observer came through. " + "; ".join(f"{row.label}: {row.why_not()}" for row in self.rows)
        best = self.best
        end = INTERRUPTED if self.stopped == INTERRUPTED else "cut short"
        stopped = f"{end} after {len(self.disturbances)} runs; so far: " if self.stopped else ""
        if best.safe:
            text = f"use {best.named}" + ("" if best.certified else " (nothing certifies it for these gaps)")
        else:
            text = f"nothing is safe here, least bad {best.named}, because of {best.why_not(self._acting(best))}"
        alone = _NOMINAL if len(self.disturbances) == 1 and not self.stopped else ""
        return f"{stopped}{text}{alone}: {self._numbers(best)}{'' if self._corrected else _UNCORRECTED}"

    @property
    def _corrected(self) -> bool:
        """Whether a telegram reached any observer in the nominal run."""
        outcome = self.benchmark.outcomes.get(self.best.candidate.name)
        events = [] if outcome is None else outcome.result.events
        return outcome is None or any(what != "undelivered" for event in events for what in event.outcomes.values())

    @property
    def groups(self) -> dict[str, list[Row]]:
        """Rows by what they are good for."""
        tried = [row for row in self.rows if row.tried]
        return {
            "use": [row for row in tried if row.safe and row.certified],
            "works but not certified": [row for row in tried if row.safe and not row.certified],
            "not for your gaps or sensors": [row for row in tried if not row.safe],
            "not tried": [row for row in self.rows if not row.tried],
        }

    def parts(self) -> Parts:
        """The answer, the plain odometer beside it, the groups, what was done, and the lines for a scenario."""
        if not self.found:
            return [self.answer, *self.tables()]
        return [self._first(), *map(_cut, self.tables()), self._done(), self.lines()]

    def tables(self) -> list[Table]:
        """A table for each group."""
        use, works, bad, left = self.groups.items()
        columns = [_NAME, _RUNS, _SHARE, _WORST, self._harder, _RMS, _SPEED, _COST]
        tables = [Table(key.replace(" ", "_"), columns, [_good(r) for r in rows], key) for key, rows in (use, works)]
        rows = [[r.named, r.share if isfinite(r.share) else None, r.why_not(self._acting(r))] for r in bad[1]]
        tables.append(Table("not_for", [_NAME, _SHARE, _BECAUSE], rows, f"{bad[0]}, because"))
        misfits = [[row.named, row.why_not()] for row in left[1]]
        return [*tables, Table("not_tried", [_NAME, _BECAUSE], misfits, left[0])]

    @property
    def _harder(self) -> Column:
        """The column of the harder runs; its heading says how many there are, which are fewer than those that count."""
        count = sum(disturbance.harder for disturbance in self.disturbances)
        meaning = f"Largest share in the first {count} disturbed runs with all twice as large; they do not count"
        return Column("harder", f"harder ({count} runs)", "%", meaning, factor=100.0)

    def lines(self) -> str:
        """The best observer as lines of a scenario."""
        candidate = self.best.candidate
        name = candidate.name
        if candidate.origin == "scenario":
            return f"# it is in the scenario already: components.{name}"
        table = candidate.table.model_dump(by_alias=True, exclude_unset=True)
        links = [connection(link, f"{name}.{signal}") for signal, link in candidate.sources.items()]
        text = tomli_w.dumps({"components": {name: table}})
        lists = [f"# into connections = [...]: {', '.join(map(repr, links))}"]
        if named_receivers(self.scenario.table()):
            lists.append(f"# into [balises], receivers = [...]: {name!r}")
        return "\n".join([*lists, text]).rstrip()

    def with_best(self) -> Scenario:
        """The scenario with the best observer, on which its report is.

        Raises:
            CosimError: the scenario cannot be changed.
        """
        return with_candidate(self.scenario, self.best.candidate)

    def to_data(self) -> dict[str, Any]:
        """Plain data."""
        best = self.rows[0] if self.found else None
        return {
            "answer": self.answer,
            "use": None if best is None else best.label,
            "safe": best is not None and best.safe,
            "certified": best is not None and best.certified,
            "allowance": self.allowance.text,
            "runs": [jsonable(disturbance) for disturbance in self.disturbances],
            "groups": {group: [row.label for row in rows] for group, rows in self.groups.items()},
            "rows": [self._row_data(row) for row in self.rows],
            "toml": self.lines() if self.found else None,
            "benchmark": self.benchmark.to_data(),
        }

    def write(self, directory: str | Path, *, figures: Pictures = False) -> dict[str, Path]:
        """Write page and data to a folder.

        Args:
            directory: the folder; created where it does not exist.
            figures: whether to draw those of the nominal run as well: True or ``"png"``, or ``"svg"``.

        Raises:
            OutputError: the folder cannot be written.
        """
        best = {row.score.name: row for row in self.rows[:_SHOWN]}
        names = {*best, *(row.score.name for row in self.rows if row.score.label == PLAIN)}
        shown = replace(self.benchmark, scores=tuple(s for s in self.benchmark.scores if s.name in names))
        good = self.found and self.best.safe
        return write_benchmark(
            shown, directory, Answer(self.answer, good, self.tables(), self.to_data()), figures=figures
        )

    def _first(self) -> str:
        plain = next((row for row in self.rows if row.candidate.model == PLAIN and row.tried), None)
        if plain is None or plain is self.best:
            return self.answer
        return f"{self.answer}\n{PLAIN}, the odometer alone: {self._numbers(plain)}"

    def _numbers(self, row: Row) -> str:
        if not isfinite(row.share):
            return "diverged"
        share = number(100.0 * row.share)
        return f"at most {share} % of the allowance in {len(row.used)} runs, position error {number(row.rms)} m rms"

    def _acting(self, row: Row) -> dict[str, str]:
        (run, used), inputs = row.worst, row.candidate.sources
        takes = {name: name in inputs or not {*_DISTURBED} & {*inputs} for name in _DISTURBED}  # by other names: both
        return {d.name: d.cause(used.time, **takes) for d in self.disturbances if d.name == run}

    def _done(self) -> str:
        tried = [row for row in self.rows if row.tried]
        most, fewest = (at([len(row.used) for row in tried if not row.failures] or [1]) - 1 for at in (max, min))
        done = (
            f"{len(tried)} observers on {self.benchmark.spec.title}: nominally and on disturbed runs, {fewest} of "
            f"them all, {most} the best. Allowance: {self.allowance.text}. Harder is each of the runs of all with "
            "every disturbance twice as large; it does not count."
        )
        return "\n".join([done, *self._remarks()])

    def _remarks(self) -> list[str]:
        """How the best observer was set, and what a run will say of its preset."""
        candidate = self.best.candidate
        settings = [f"{self.best.label}: {' '.join(candidate.settings)}"] if candidate.settings else []
        return [*settings, *(f"{text} Here it was measured, and is used as it stands." for text in self.best.remarks)]

    def _row_data(self, row: Row) -> dict[str, Any]:
        return {
            "observer": row.label,
            "same": list(row.also),
            "runs": len(row.used),
            "safe": row.safe,
            "certified": row.certified,
            "share": row.share,
            "rms_position_error": row.rms,
            "because": row.why_not(self._acting(row)),
            "used": jsonable(row.used),
            "harder": jsonable(row.harder),
            "failures": dict(row.failures),
        }


def _cut(table: Table) -> Table:
    """The first rows of a table, with the names of the others."""
    left = ", ".join(str(row[0]) for row in table.rows[_CUT:])
    if not left:
        return table
    return replace(table, rows=table.rows[:_CUT], notes=[*table.notes, f"likewise, or worse: {left}"])


def _good(row: Row) -> list[Any]:
    harder = max((used.share for used in row.harder.values()), default=None)
    cost = row.score.cost
    return [
        row.named,
        len(row.used),
        row.share,
        f"{row.worst[0]} at {row.worst[1].time:.0f} s",
        harder,
        row.rms,
        row.score.speed_rms,
        None if cost is None else 1e-6 * cost,
    ]
