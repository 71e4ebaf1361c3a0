"""The first sentence of the page of a run, and its largest finding with what happened there. Imports NumPy only.

Every observer is judged by itself: one that fails makes no other worse, and is named.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, isnan, nan

import numpy as np

from cosim.evaluation.balise_gaps import GapErrors, gap_errors
from cosim.evaluation.event_counts import accepted_stamps
from cosim.evaluation.metrics import evaluated_size
from cosim.evaluation.result_warnings import all_warnings, largest_tolerable
from cosim.evaluation.roles import Quantity, estimation_error, label, recorded
from cosim.evaluation.spec import ReportSpec
from cosim.evaluation.summary_entries import mapping_entry, number_entry
from cosim.expectations.evaluated import Evaluated
from cosim.report.live.first_sentence import first_sentence
from cosim.report.live.live_page import Mark, PageVerdict
from cosim.report.page.run_curves import QUANTITIES
from cosim.results.result import Result
from fmus.tables.numbers import instant, number

_CAUSES = ("fault", "zone", "telegram problem", "failure", "message")
"""Kinds of marks that may be why an error is large."""
_BEFORE = 2.0  # of the usual gaps: as long before, what happened may be why
_LONG_GAP = 1.5  # of the usual gaps: a longer one is named
_SHORTLY = 3.0  # [s]: what began or ended as long before may still act on an observer


@dataclass(frozen=True, slots=True)
class ObserverStatus:
    """How an observer did.

    Args:
        name: of its component. speed, position: largest error after the start-up [m/s], [m]; NaN where it is not known,
            infinite once diverged. fails: whether its speed says nothing of this train. within: share of the gaps
            between balises at whose end the position error is inside SUBSET-041 [1]; NaN without gaps.
    """

    name: str
    speed: float
    position: float
    fails: bool
    within: float

    @property
    def order(self) -> tuple[bool, float, float]:
        """The best observer has the smallest."""
        size = self.position if not isnan(self.position) else self.speed
        return self.fails, -self.within if not isnan(self.within) else 0.0, size

    def sizes(self) -> str:
        """Its largest errors in words."""
        known = [(self.speed, "m/s"), (self.position, "m")]
        return " and ".join(f"{number(v)} {unit}" for v, unit in known if isfinite(v))


def observer_statuses(result: Result, spec: ReportSpec) -> list[ObserverStatus]:
    """How each observer with an error of speed or position did, the best first.

    Args:
        result: the run. spec: roles, start of the evaluation.
    """
    settled = result.time >= spec.evaluate_after
    tolerable, gaps = largest_tolerable(result, spec), gap_errors(result, spec)

    def largest(observer: str, quantity: Quantity) -> float:
        error = estimation_error(result, spec, observer, quantity)
        return nan if error is None else evaluated_size(result.time[settled], error[settled]).max_abs

    found = []
    for observer in spec.observers:
        speed, position = largest(observer, "speed"), largest(observer, "position")
        fails = speed > tolerable or position == np.inf
        if any(estimation_error(result, spec, observer, q) is not None for q in QUANTITIES):
            found.append(ObserverStatus(observer, speed, position, fails, _within(gaps, observer)))
    return sorted(found, key=lambda status: status.order)


def _within(gaps: GapErrors, observer: str) -> float:
    return gaps.within_envelope(observer) if observer in gaps.errors else nan


def run_verdict(
    result: Result, spec: ReportSpec, evaluated: Sequence[Evaluated], statuses: Sequence[ObserverStatus]
) -> PageVerdict:
    """What a run comes to, in a sentence or two.

    Args:
        result: the run. spec: roles. evaluated: expectations. statuses: from `observer_statuses`.
    """
    reached = instant(float(result.time[-1])) if len(result.time) else "0"
    if result.failure is not None:
        stop = number_entry(result.summary, "stop")
        end = f"at {reached} s" + (f" of {instant(stop)} s" if stop is not None else "")
        return PageVerdict(f"The run ended early, {end}: {first_sentence(result.failure)[0]}", "bad")
    if not len(result.time):
        return PageVerdict("The run has no rows: nothing was recorded, and nothing can be said of it.", "bad")
    unmet = [one for one in evaluated if not one.passed]
    speed = recorded(result, spec.true_speed)
    moves = speed is None or not len(speed) or bool(np.any(~(np.abs(speed) <= 0.01)))
    if not moves:
        text = f"The train never moves up to {reached} s: this run says nothing of its observers."
        return PageVerdict(_with_unmet(unmet, evaluated, text), "bad" if unmet else "doubt")
    text, good = _of_observers(spec, statuses) if statuses else (_without_observers(result, reached), True)
    mood = "bad" if unmet or (statuses and all(s.fails for s in statuses)) else "good" if good else "doubt"
    others = len(all_warnings(result, spec)) - sum(s.fails for s in statuses)
    if others > 0 and mood == "good":
        mood, text = "doubt", f"{text} {others} {'warning' if others == 1 else 'warnings'}."
    return PageVerdict(_with_unmet(unmet, evaluated, text), mood)  # type: ignore[arg-type]  # one of the moods


def _with_unmet(unmet: Sequence[Evaluated], evaluated: Sequence[Evaluated], text: str) -> str:
    if not unmet:
        return f"{text} All {len(evaluated)} expectations are met." if evaluated else text
    return (
        f"{len(unmet)} of {len(evaluated)} expectations are not met, first: {unmet[0].name} ({unmet[0].text}). {text}"
    )


def _counted(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def _without_observers(result: Result, reached: str) -> str:
    names = (result.table.dtype.names or ())[1:]
    signals = _counted(len(names), "signal")
    components = _counted(len({name.partition(".")[0] for name in names}), "component")
    text = f"The run is complete to {reached} s: {signals} of {components}; nothing is estimated in it."
    missing = [name for name in names if not np.isfinite(result[name]).all()]
    return f"{text} Not finite somewhere: {', '.join(missing[:3])}." if missing else text


def _of_observers(spec: ReportSpec, statuses: Sequence[ObserverStatus]) -> tuple[str, bool]:
    """What the observers came to, and whether all are good."""
    work, fail = [s for s in statuses if not s.fails], [s for s in statuses if s.fails]
    names = ", ".join(label(spec, s.name) for s in fail)
    failing = (
        f" {names} {'fails' if len(fail) == 1 else 'fail'}: off by more than the speed of the train." if fail else ""
    )
    if not work:
        return f"No observer is of use here.{failing}", False
    best, count = work[0], len(statuses)
    if not best.sizes():
        return f"Too few rows are judged to say anything of {label(spec, best.name)}.{failing}", False
    inside = [s for s in statuses if s.within >= 1.0]
    where = _where(best)
    if count == 1:
        return f"{label(spec, best.name)} is off by at most {best.sizes()}{where}.", not best.within < 1.0
    if not isnan(best.within):
        text = f"{len(inside)} of {count} observers are inside SUBSET-041 at every balise; the best, "
        text += f"{label(spec, best.name)}, is off by at most {best.sizes()}{'' if inside else where}."
    else:
        text = f"The best of {count} observers, {label(spec, best.name)}, is off by at most {best.sizes()}"
        text += (
            f"; the worst{' of the others' if fail else ''}, {label(spec, work[-1].name)}, by {work[-1].sizes()}."
            if len(work) > 1
            else "."
        )
    return text + failing, not fail and all(not s.within < 1.0 for s in work)


def _where(status: ObserverStatus) -> str:
    if isnan(status.within):
        return ""
    share = number(100.0 * (1.0 - status.within), 2)
    return (
        ", inside SUBSET-041 at every balise"
        if status.within >= 1.0
        else f", outside SUBSET-041 at {share} % of the balises"
    )


def largest_finding(result: Result, spec: ReportSpec, statuses: Sequence[ObserverStatus], marks: Sequence[Mark]) -> str:
    """The largest error of all observers, and what happened at that time; without observers the first warning.

    Args:
        result: the run. spec: roles. statuses: from `observer_statuses`. marks: from `run_marks`.
    """
    if not statuses:
        return next(iter(all_warnings(result, spec)), "")
    worst = statuses[-1]
    if worst.fails:
        error = estimation_error(result, spec, worst.name, "speed")
        if error is None:
            return ""
        lost = (result.time >= spec.evaluate_after) & ~(np.abs(error) <= largest_tolerable(result, spec))
        time = float(result.time[int(np.argmax(lost))])
        what = f"{label(spec, worst.name)} is off by more than the speed of the train from {instant(time)} s on"
        return _with_causes(what, time, worst.name, result, marks)
    panel = "Position error" if any(not isnan(s.position) for s in statuses) else "Speed error"
    largest = [m for m in marks if m.kind == "worst" and m.panel == panel and m.value is not None]
    if not largest:
        return ""
    mark = max(largest, key=lambda m: abs(m.value or 0.0))
    name = next(s.name for s in statuses if mark.text.startswith(f"largest {panel.lower()} of {label(spec, s.name)}:"))
    text = f"{mark.text[0].upper()}{mark.text[1:]}, at {instant(mark.start)} s"
    return _with_causes(text, mark.start, name, result, marks)


def _with_causes(what: str, time: float, observer: str, result: Result, marks: Sequence[Mark]) -> str:
    causes = [*_causes(time, observer, result, marks), *_changes(time, marks), *_telegram_then(time, result, marks)]
    if causes:
        return f"{what}: {'; '.join(causes)}."
    return f"{what}. No fault, zone or change of phase lies near, and no telegram came at that instant."


def _causes(time: float, observer: str, result: Result, marks: Sequence[Mark]) -> Iterator[str]:
    """What happened there or shortly before, and what was known before the run."""
    stamps = np.array(accepted_stamps(result.events, observer))
    usual = float(np.median(np.diff(stamps))) if len(stamps) > 2 else 0.0
    near = [
        m
        for m in marks
        if m.kind in _CAUSES and m.start <= time <= (m.end if m.end is not None else m.start + _BEFORE * usual)
    ]
    for mark in {m.kind: m for m in near}.values():  # the last of each kind
        until = f" to {instant(mark.end)} s" if mark.end is not None else " s"
        yield f"{mark.text} ({instant(mark.start)}{until})"
    before = stamps[stamps < time]
    if len(before) and usual and time - before[-1] > _LONG_GAP * usual:
        yield f"the last telegram it used was {number(time - float(before[-1]))} s before, {number(usual)} s are usual"
    entry = mapping_entry(result, "certificates").get(observer)
    if isinstance(entry, Mapping) and str(entry.get("holds")) == "False" and entry.get("explanation"):
        yield f"its certificate does not hold: {first_sentence(entry['explanation'])[0]}".rstrip(".")


def _changes(time: float, marks: Sequence[Mark]) -> Iterator[str]:
    """A fault or zone that ended shortly before, a phase that began shortly before: the last of each kind."""
    ended = [m for m in marks if m.kind in ("fault", "zone") and m.end is not None and 0.0 < time - m.end <= _SHORTLY]
    for mark in {m.kind: m for m in sorted(ended, key=lambda m: m.end or 0.0)}.values():
        yield f"{mark.text} until {number(time - (mark.end or 0.0))} s before ({_span(mark)})"
    began = [m for m in marks if m.kind == "phase" and 0.0 <= time - m.start <= _SHORTLY]
    for mark in began[-1:]:
        yield f"{mark.text} began {number(time - mark.start)} s before ({_span(mark)})"


def _span(mark: Mark) -> str:
    return f"{instant(mark.start)} to {instant(mark.end or 0.0)} s"


def _telegram_then(time: float, result: Result, marks: Sequence[Mark]) -> Iterator[str]:
    """A telegram at that instant, no farther from it than the rows around it, or one that was on its way."""
    first = float(np.max(result.time[result.time < time], initial=-np.inf))
    last = float(np.min(result.time[result.time > time], initial=np.inf))
    then = [m for m in marks if first <= m.start <= last]
    for mark in [m for m in then if m.kind == "balise" or (m.kind == "telegram problem" and m.start > time)][-1:]:
        yield f"{mark.text}, at that instant"
    for event in [e for e in result.events if e.stamp < first <= e.delivered_at][-1:]:
        yield (
            f"balise {event.identity} was passed at {instant(event.stamp)} s, and its telegram came at "
            f"{instant(event.delivered_at)} s"
        )
