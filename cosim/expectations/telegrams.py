"""Judge of balise telegrams: how many were missed, false, rejected, late, undelivered and used. Standard library
only.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from cosim.evaluation.event_counts import USED
from cosim.expectations.judged import Judged
from cosim.expectations.run import Run, span
from cosim.expectations.window import Window
from cosim.results.result import BaliseRecord

if TYPE_CHECKING:
    from cosim.scenario.expectation_tables import TelegramsExpectation

OF_THE_TRACK = ("missed", "false")
OF_A_RECEIVER = ("rejected", "late", "undelivered")
NAMES_SHOWN = 5


def judge_telegrams(item: TelegramsExpectation, run: Run) -> list[Judged]:
    """Counts of the telegrams stamped within the window: of the track as a whole, and at each receiver."""
    window = run.window(item.start, item.end)
    within = [e for e in run.result.events if window.holds(e.stamp)]
    receivers = [item.of] if item.of is not None else sorted({name for e in run.result.events for name in e.outcomes})
    where = span(item.start, item.end)
    if not within:
        text = f"nothing to judge: no balise was passed{where or ' in this run'}"
        return [Judged("telegrams", "telegrams", passed=False, measured=0.0, text=text)]
    found = []
    for key in OF_THE_TRACK:
        if getattr(item, key) is not None:
            chosen = [e for e in within if e.kind == key]
            found.append(_at_most(f"telegrams {key}{where}", getattr(item, key), chosen, window))
    for receiver in receivers or [""]:
        at = f" at {receiver}" if receiver else ""
        for key in OF_A_RECEIVER:
            if getattr(item, key) is not None:
                chosen = [e for e in within if e.outcomes.get(receiver) == key]
                found.append(_at_most(f"telegrams {key}{at}{where}", getattr(item, key), chosen, window))
        if item.used is not None:
            used = [e for e in within if e.outcomes.get(receiver) in USED]
            found.append(_at_least(f"telegrams used{at}{where}", item.used, used, window))
    return found


def _at_most(name: str, limit: int, chosen: list[BaliseRecord], window: Window) -> Judged:
    passed = len(chosen) <= limit
    named = ", ".join(f"{e.identity or 'without name'} at {e.stamp:.6g} s" for e in chosen[:NAMES_SHOWN])
    more = ", ..." if len(chosen) > NAMES_SHOWN else ""
    text = f"{len(chosen)}, expected at most {limit}" + (f" ({named}{more})" if not passed else "")
    text += f"; {window.unreached}" if passed and window.broken else ""
    when = chosen[limit].stamp if not passed else float("nan")
    return _counted(name, passed and not window.broken, chosen, limit, when, text)


def _at_least(name: str, limit: int, chosen: list[BaliseRecord], window: Window) -> Judged:
    """Enough telegrams are enough, also where the run ended early."""
    passed = len(chosen) >= limit
    text = f"{len(chosen)}, expected at least {limit}" + (
        f"; {window.unreached}" if not passed and window.broken else ""
    )
    return _counted(name, passed, chosen, limit, float("nan"), text)


def _counted(name: str, passed: bool, chosen: list[BaliseRecord], limit: int, when: float, text: str) -> Judged:
    return Judged(name, "telegrams", passed, float(len(chosen)), float(limit), when=when, text=text)
