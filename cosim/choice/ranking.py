"""The order of observers over several disturbed runs: safe ones first, then by the error of the position."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import hypot, inf, isfinite, sqrt
from typing import Any

from cosim.choice.allowance import UsedAllowance
from cosim.choice.candidates import BenchmarkCandidate
from cosim.choice.observer_scores import SEEN_GAP, ObserverScore
from fmus.tables.numbers import number

TIE = 0.1
"""Share of the allowance below which two observers do not differ [1]."""
NEAR, MOST = 1.5, 6
"""Factor of the best up to which another one may still be it, and how many of them run on further seeds."""
_ROUNDING = 1e-9
"""Of a run as a share of all: 28 of 37 and one more are 29 of 37 but for the last bit."""
NOTHING = UsedAllowance(inf, 0.0, inf, inf)
"""Of an observer that fails: more than there is."""


@dataclass(frozen=True)
class Row:
    """An observer in a choice.

    Args:
        score: of the nominal run. candidate: how it is set. used: of the allowance, by the name of the run; those that
            count. harder: of the allowance in runs that do not.
        failures: why it failed, by the name of the run. remarks: what a run says of its preset beside this train.
        also: labels of presets that are the same here.
    """

    score: ObserverScore
    candidate: BenchmarkCandidate
    used: Mapping[str, UsedAllowance]
    harder: Mapping[str, UsedAllowance] = field(default_factory=dict)
    failures: Mapping[str, str] = field(default_factory=dict)
    remarks: Sequence[str] = ()
    also: Sequence[str] = ()

    @property
    def named(self) -> str:
        """To show, with the presets that are the same."""
        return " = ".join((self.label, *self.also))

    @property
    def label(self) -> str:
        """To show; one of the scenario that has no label is named with its model."""
        own = self.candidate
        if own.origin != "scenario" or own.table.label is not None:
            return self.score.label
        return f"{own.name} ({':'.join(filter(None, (own.model, own.table.preset)))})"

    @property
    def tried(self) -> bool:
        """Whether it ran at all."""
        return bool(self.used)

    @property
    def worst(self) -> tuple[str, UsedAllowance]:
        """The run in which it uses most of the allowance, and how much; one that fails uses more than there is."""
        if not self.used:
            return "", NOTHING
        failed = {name: NOTHING for name in self.failures if name in self.used}
        every = {**self.used, **failed}
        name = max(every, key=lambda name: every[name].share)
        return name, every[name]

    @property
    def share(self) -> float:
        """The largest share of the allowance that it uses [1]."""
        return self.worst[1].share

    @property
    def beyond(self) -> float:
        """Share of the runs that count in which it leaves the allowance [1]."""
        lost = [name in self.failures or used.share > 1.0 for name, used in self.used.items()]
        return sum(lost) / len(lost) if lost else 1.0

    @property
    def safe(self) -> bool:
        """Whether it stays within the allowance in all runs that count."""
        return self.share <= 1.0

    @property
    def rms(self) -> float:
        """Root mean square of the position error over all runs that count [m]."""
        found = [inf if name in self.failures else used.rms for name, used in self.used.items()]
        return hypot(*found) / sqrt(len(found)) if found and all(e < 1e150 for e in found) else inf

    @property
    def certified(self) -> bool:
        """Whether its gains are certified for the gaps expected, or, where these are not known, for those seen."""
        gap = self.score.certificate
        if gap is None:
            return False
        return bool(gap.condition(SEEN_GAP).holds) if gap.holds is None else gap.holds

    def why_not(self, causes: Mapping[str, str] | None = None) -> str:
        """Why it is none to be used, in words; empty where it is safe.

        Args:
            causes: what acted when it was worst, by the name of the run.
        """
        if not self.tried:
            return str(self.score.failure or "")
        gap = self.score.certificate
        reasons = []
        if gap is not None and not self.certified and isfinite(gap.value):
            longer = [g for g in (gap.demand, gap.condition(SEEN_GAP).value) if g is not None and g > gap.value]
            text = f"its gains are certified for gaps up to {number(gap.value)} s, here are "
            reasons += [f"{text}{number(max(longer))} s"] if longer else []
        run, used = self.worst
        if self.failures:
            reasons += [next(iter(self.failures.values()))]
        elif not self.safe:
            acting = (causes or {}).get(run, "")
            beyond = sum(one.share > 1.0 for one in self.used.values())
            text = f"{number(used.share)} times the allowance in {run} at {used.time:.0f} s"
            text += f", {acting}" if acting else ""
            reasons += [f"{text} ({beyond} of {len(self.used)} runs beyond it)"]
        return "; ".join(reasons) if not self.safe else ""


def ranked(rows: Sequence[Row]) -> list[Row]:
    """The rows in order, the best first.

    Safe ones come before all others, or, where nothing is safe, those that leave the allowance in the smallest share of
    their runs, or in one run more, which is chance. Of these the error decides; but those that differ by less than
    `TIE` of the allowance are as good: of those whose error is within it of the smallest the ones come first whose
    share of the allowance is within it of the smallest, of these presets that were not made for another train, and of
    these certified ones. What is left comes in the order of how often it leaves the allowance.

    Args:
        rows: in any order.
    """
    tried = [row for row in rows if row.tried]
    good = _good(tried)
    error = min((row.rms for row in good), default=inf) + TIE * allowed(tried)
    share = min((row.share for row in good if row.rms <= error), default=inf) + TIE

    def place(row: Row) -> tuple[Any, ...]:
        if all(row is not one for one in good):
            return 3, not isfinite(row.rms), row.beyond, row.share, row.label
        if row.rms > error:
            return 2, row.rms, row.share, row.label
        if row.share > share:
            return 1, row.share, row.rms, row.label
        return 0, bool(row.remarks), not row.certified, row.rms, row.label

    return [*sorted(tried, key=place), *(row for row in rows if not row.tried)]


def _good(rows: Sequence[Row]) -> list[Row]:
    """The safe rows, or, where there is none, those that leave the allowance least often, and in one run more."""
    safe = [row for row in rows if row.safe]
    finite = [row for row in rows if isfinite(row.rms)]
    if safe or not finite:
        return safe
    run = (1.0 + _ROUNDING) / max(len(row.used) for row in finite)
    rarely = min(row.beyond for row in finite) + run
    return [row for row in finite if row.beyond <= rarely]


def contenders(rows: Sequence[Row]) -> list[Row]:
    """The rows that may be the best ones, the best first: safe, or beyond the allowance as rarely as any, and not far
    from the best in their error.

    Args:
        rows: in any order.
    """
    among = _good([row for row in rows if row.tried])
    good = [row for row in ranked(rows) if any(row is one for one in among)]
    limit = max(NEAR * good[0].rms, good[0].rms + TIE * allowed(good)) if good else 0.0
    return [row for row in good if row.rms <= limit][:MOST]


def allowed(rows: Sequence[Row]) -> float:
    """Root mean square of the allowance over the runs that count [m]; 0 without any.

    Args:
        rows: of observers that ran.
    """
    found = [used.allowed for row in rows for used in row.used.values() if isfinite(used.allowed)]
    return sqrt(sum(a**2 for a in found) / len(found)) if found else 0.0
