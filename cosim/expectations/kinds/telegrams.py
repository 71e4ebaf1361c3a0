"""So many balise telegrams were missed, false, rejected, ignored, doubted, late, undelivered or used."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, Self

from pydantic import model_validator

from cosim.errors import ScenarioError, nearest
from cosim.evaluation.event_counts import USED
from cosim.expectations.evaluated import Evaluated
from cosim.expectations.evaluated_run import EvaluatedRun, TimeWindow, span
from cosim.expectations.expectation import Count, WindowExpectation
from cosim.results.result_data import BaliseRecord
from cosim.toml_table import Name

if TYPE_CHECKING:
    from cosim.expectations.before import Before

_OF_THE_TRACK = ("missed", "false")
_OF_A_RECEIVER = {
    "rejected": ("rejected", "ignored"),
    "ignored": ("ignored",),
    "doubted": ("doubted",),
    "late": ("late",),
    "undelivered": ("undelivered",),
}
"""Outcomes that count: what a gate ignored was not taken either, whoever refused it."""
COUNTS = (*_OF_THE_TRACK, *_OF_A_RECEIVER, "used")
NAMES_SHOWN = 5


class TelegramsExpectation(WindowExpectation):
    """So many balise telegrams at most were missed, false, rejected (by a policy for late ones, or ignored by a gate),
    ignored, doubted, late or undelivered; so many at least were used.
    """

    check: Literal["telegrams"]
    of: Name | None = None
    missed: Count | None = None
    false: Count | None = None
    rejected: Count | None = None
    ignored: Count | None = None
    doubted: Count | None = None
    late: Count | None = None
    undelivered: Count | None = None
    used: Count | None = None

    @model_validator(mode="after")
    def _counted(self) -> TelegramsExpectation:
        if all(getattr(self, key) is None for key in COUNTS):
            names = ", ".join(map(repr, COUNTS[:-1]))
            raise ValueError(f"give at least one of {names} and {COUNTS[-1]!r}")
        return self

    def prepare(self, before: Before) -> Self:
        """There are balises, and the receiver is notified of them."""
        super().prepare(before)
        if before.receivers is None:
            raise ScenarioError("this scenario has no balises; give it a table [balises]")
        if self.of is not None and self.of not in before.receivers:
            raise ScenarioError(f"{self.of!r} receives no telegrams; {nearest(self.of, before.receivers)}")
        return self

    def evaluate(self, run: EvaluatedRun) -> list[Evaluated]:
        """Counts of the telegrams stamped within the window: of the track as a whole, and at each receiver."""
        window = run.window(self.start, self.end)
        within = [e for e in run.result.events if window.holds(e.stamp)]
        receivers = (
            [self.of] if self.of is not None else sorted({name for e in run.result.events for name in e.outcomes})
        )
        where = span(self.start, self.end)
        if not within:
            text = f"nothing to evaluate: no balise was passed{where or ' in this run'}"
            return [Evaluated("telegrams", "telegrams", passed=False, measured=0.0, text=text)]
        found = []
        for key in _OF_THE_TRACK:
            if getattr(self, key) is not None:
                chosen = [e for e in within if e.kind == key]
                found.append(_at_most(f"telegrams {key}{where}", getattr(self, key), chosen, window))
        for receiver in receivers or [""]:
            at = f" at {receiver}" if receiver else ""
            for key, outcomes in _OF_A_RECEIVER.items():
                if getattr(self, key) is not None:
                    chosen = [e for e in within if e.outcomes.get(receiver) in outcomes]
                    found.append(_at_most(f"telegrams {key}{at}{where}", getattr(self, key), chosen, window))
            if self.used is not None:
                used = [e for e in within if e.outcomes.get(receiver) in USED]
                found.append(_at_least(f"telegrams used{at}{where}", self.used, used, window))
        return found


def _at_most(name: str, limit: int, chosen: list[BaliseRecord], window: TimeWindow) -> Evaluated:
    passed = len(chosen) <= limit
    named = ", ".join(f"{e.identity or 'without name'} at {e.stamp:.6g} s" for e in chosen[:NAMES_SHOWN])
    more = ", ..." if len(chosen) > NAMES_SHOWN else ""
    text = f"{len(chosen)}, expected at most {limit}" + (f" ({named}{more})" if not passed else "")
    text += f"; {window.unreached}" if passed and window.broken else ""
    when = chosen[limit].stamp if not passed else float("nan")
    return _counted(name, passed and not window.broken, chosen, limit, when, text)


def _at_least(name: str, limit: int, chosen: list[BaliseRecord], window: TimeWindow) -> Evaluated:
    """Enough telegrams are enough, also where the run ended early."""
    passed = len(chosen) >= limit
    text = f"{len(chosen)}, expected at least {limit}" + (
        f"; {window.unreached}" if not passed and window.broken else ""
    )
    return _counted(name, passed, chosen, limit, float("nan"), text)


def _counted(name: str, passed: bool, chosen: list[BaliseRecord], limit: int, when: float, text: str) -> Evaluated:
    return Evaluated(name, "telegrams", passed, float(len(chosen)), float(limit), when=when, text=text)
