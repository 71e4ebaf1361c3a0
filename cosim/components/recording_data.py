"""Recordings: columns over time, from a result or a measured table, and what they were at any instant. NumPy and
results only.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from cosim.errors import ScenarioError, nearest
from cosim.results.formats.columns import TEXTS
from cosim.results.result import Result, SignalInfo
from fmus.fmi.standard import NEVER, TIME_TOLERANCE

Interpolation = Literal["linear", "hold"]
Chosen = Interpolation | Mapping[str, Interpolation] | None
"""What was said of the columns: of all, of some by name, or nothing."""
ColumnCourse = Literal["held", "line", "fresh"]


@dataclass(frozen=True)
class Recording:
    """Columns over time, as they are played back.

    Args:
        source: where they come from, for people.
        time: of the rows [s], not decreasing, shape (rows,). Of rows with the same time the first one is before an
            event, the last one after it.
        signals: what each column is; names without a component.
        values: shape (rows, n), finite; NaN in signals that can be missing.
        held: mask of the columns that keep their value until the next row, shape (n,); the others run on lines.
        events: times at which something may have jumped [s], increasing.
        left_out: columns that cannot be played back, by name, and why.
        held_over_steps: columns of which the others take the value at the start of a step: held ones of a table, and of
            a run of this package those that were held in it.
        of_run: whether it is a run of this package.
        held_links, fresh_links: of a run, all its connections that were held, and those that were fresh, as text.
        before_start: of a run, columns that jumped when it was initialised, and what they were before.
        chosen: names of the columns of which it was said whether they are held.
        lines: columns that the others follow on lines within their steps: those of a table that are not held, and of a
            run those that were lines in it. All others give the value of the end of a step, as they did in the run.
        texts: of columns of texts, what their numbers stand for, 1 for the first.
        first_row: how many rows of the table stand before the first one that is played back.
    """

    source: str
    time: np.ndarray
    signals: tuple[SignalInfo, ...]
    values: np.ndarray
    held: np.ndarray
    events: np.ndarray
    left_out: Mapping[str, str] = field(default_factory=dict)
    held_over_steps: frozenset[str] = frozenset()
    lines: frozenset[str] = frozenset()
    chosen: frozenset[str] = frozenset()
    of_run: bool = False
    before_start: Mapping[str, float] = field(default_factory=dict)
    held_links: frozenset[str] = frozenset()
    fresh_links: frozenset[str] = frozenset()
    first_row: int = 0
    texts: Mapping[str, Sequence[str]] = field(default_factory=dict)

    @cached_property
    def digest(self) -> str:
        """What distinguishes this recording from others: a hash of times, names and values."""
        names = "\0".join(s.name for s in self.signals).encode()
        return hashlib.sha256(names + self.time.tobytes() + self.values.tobytes()).hexdigest()[:32]

    def next_event(self, t: float) -> float:
        """The first event later than `t` [s]; infinite where there is none."""
        at = int(np.searchsorted(self.events, t + TIME_TOLERANCE, side="right"))
        return float(self.events[at]) if at < len(self.events) else NEVER

    def at(self, t: float, *, before: bool = False) -> np.ndarray:
        """All columns at `t` [s], shape (n,): where there is a row of this time exactly what it says.

        Args:
            t: within the recording. before: of several rows of this time the first one instead of the last one.
        """
        row = int(np.searchsorted(self.time, t + TIME_TOLERANCE, side="right")) - 1
        if row < 0 or (row == len(self.time) - 1 and t > self.time[row] + TIME_TOLERANCE):
            raise ValueError(f"t = {t:g} s is outside of the recording, {self.time[0]:g} s to {self.time[-1]:g} s")
        if self.time[row] >= t - TIME_TOLERANCE:
            return np.asarray(
                self.values[np.searchsorted(self.time, t - TIME_TOLERANCE)] if before else self.values[row]
            )
        here, following = self.values[row], self.values[row + 1]
        share = (t - self.time[row]) / (self.time[row + 1] - self.time[row])
        return np.asarray(np.where(self.held, here, here + share * (following - here)))

    def mean(self, t: float, until: float) -> np.ndarray:
        """Means of the lines from `t` to `until` [s], shape (n,): exact, whatever rows lie between.

        Args:
            t: within the recording, of several rows there the last one counts. until: later, there the first one.
        """
        inside = slice(*np.searchsorted(self.time, [t + TIME_TOLERANCE, until - TIME_TOLERANCE]))
        instants = np.concatenate([[t], self.time[inside], [until]])
        rows = np.vstack([self.at(t), self.values[inside], self.at(until, before=True)])
        parts = np.diff(instants)[:, None] * (0.5 * (rows[1:] + rows[:-1]))
        return np.asarray(np.add.accumulate(parts)[-1] / (until - t))  # one after the other, as the stepper in C

    def kept(self, name: str) -> Recording:
        """This recording with one more column held.

        Args:
            name: of the column.
        """
        names = [signal.name for signal in self.signals]
        held = self.held | (np.array(names) == name)
        return replace(self, held=held, held_over_steps=self.held_over_steps | {name}, lines=self.lines - {name})


def make_recording(
    result: Result,
    source: str,
    component: str | None,
    name: str,
    interpolation: Chosen,
    span: tuple[float, float] | None,
    can_be_missing: Collection[str] = (),
) -> Recording:
    """The recording of one component of a result, or of a whole table.

    Args:
        result: what was recorded. source: where it comes from, for messages.
        component: whose columns are taken. None: those of `name` where it was recorded, else all under their full
            names.
        name: of the component that plays it back.
        interpolation: whether columns are held or run on lines: said of all, or of some by name. Of the others a run
            of this package says what they were in it; what was recorded as discrete is held.
        span: start and stop of the run [s], which the recording must cover; None where nobody steps it.
        can_be_missing: columns in which NaN stands for a missing value, beside those recorded as such. Between two rows
            of which one is missing a line is missing too.

    Raises:
        ScenarioError: nothing was recorded, the component is not in it, times do not increase, or it does not cover the
        run.
    """
    chosen = _chosen(result, source, component, name)
    texts = result.summary.get(TEXTS, {})
    said = said_of(interpolation, [signal.name for signal in chosen.values()], source)
    time = np.array(result.time, dtype=float)
    _check_time(time, source, span)
    rows = _rows(time, span)
    played, left_out = _playable(result, chosen, said, time, rows, can_be_missing)
    if not played:
        raise ScenarioError(
            f"{source}: no column can be played back; " + "; ".join(f"{n}: {w}" for n, w in left_out.items())
        )
    signals, values = tuple(signal for signal, _ in played), np.column_stack([column for _, column in played])
    asked = {column: said[s.name] for column, s in chosen.items() if s.name in said}
    kinds = {s.name: kind for s, kind in zip(chosen.values(), column_courses(result, chosen, asked), strict=True)}
    kept, lines = (frozenset(s.name for s in signals if kinds[s.name] == one) for one in ("held", "line"))
    shared, fresh = (frozenset(map(str, _algorithm(result).get(key, ()))) for key in ("held", "fresh"))
    return Recording(
        source,
        time[rows],
        signals,
        values,
        np.array([said.get(s.name) == "hold" or s.variability == "discrete" for s in signals]),
        _events(time[rows], values, np.array([e.delivered_at for e in result.events])),
        left_out,
        kept,
        lines,
        frozenset(said),
        _is_run(result),
        _before_start(result, chosen, time[rows][0]),
        shared,
        fresh,
        rows.start or 0,
        {s.name: list(texts[c]) for c, s in chosen.items() if c in texts},
    )


def column_courses(
    result: Result, columns: Iterable[str], said: Mapping[str, Interpolation], discrete: Collection[str] = ()
) -> list[ColumnCourse]:
    """How columns run between their instants: ``held``, the value of the start of a step; on a ``line``; or ``fresh``,
    the value of the end of a step, as in a run of this package.

    Args:
        result: a run, which knows how it took its signals, or a table. columns: names. said: by name what was said.
        discrete: those of which the target is discrete; where nothing else is known they are held.
    """
    stated, of_run = _recorded(result), _is_run(result)
    found: list[ColumnCourse] = []
    for name in columns:
        if name in said:
            found.append("held" if said[name] == "hold" or result.info(name).variability == "discrete" else "line")
        elif of_run:
            found.append(stated.get(name, "fresh"))
        else:
            found.append("held" if name in discrete or result.info(name).variability == "discrete" else "line")
    return found


def interval_ends(values: np.ndarray, first: np.ndarray, last: np.ndarray, course: ColumnCourse) -> np.ndarray:
    """What a column says at begin and end of each interval between instants, shape (2, n - 1).

    Args:
        values: of all rows. first, last: numbers of the first and the last row of each instant, shape (n,).
        course: how it runs between them.
    """
    begin, end = values[last[:-1]], values[first[1:]]
    return np.stack({"held": (begin, begin), "fresh": (end, end), "line": (begin, end)}[course])


def said_of(interpolation: Chosen, names: Sequence[str], source: str) -> dict[str, Interpolation]:
    """What was said of each column, by name.

    Args:
        interpolation: of all columns, of some, or nothing. names: of the columns. source: for messages.

    Raises:
        ScenarioError: there is no such column.
    """
    if not isinstance(interpolation, Mapping):
        return {} if interpolation is None else dict.fromkeys(names, interpolation)
    for name in interpolation:
        if name not in names:
            raise ScenarioError(f"{source}: interpolation: there is no column {name!r}; {nearest(name, names)}")
    return dict(interpolation)


def _playable(
    result: Result,
    chosen: Mapping[str, SignalInfo],
    said: Mapping[str, Interpolation],
    time: np.ndarray,
    rows: slice,
    can_be_missing: Collection[str],
) -> tuple[list[tuple[SignalInfo, np.ndarray]], dict[str, str]]:
    """The columns that can be played back with their values in these rows, and by name why others cannot."""
    played, left_out = list[tuple[SignalInfo, np.ndarray]](), dict[str, str]()
    for column, signal in chosen.items():
        values = np.array(result.table[column][rows], dtype=float)
        if signal.name in can_be_missing or signal.can_be_missing:
            known = replace(signal, can_be_missing=True)
            played.append((known, np.where(np.isfinite(values), values, np.nan)))
            continue
        values, fault = _without_gaps(values, time[rows], said.get(signal.name, "linear"))
        if fault:
            left_out[signal.name] = fault
        else:
            played.append((signal, values))
    return played, left_out


def _before_start(result: Result, chosen: Mapping[str, SignalInfo], begin: float) -> dict[str, float]:
    """What columns were before a run that is played back from its begin [s] was initialised, by name."""
    known = _algorithm(result).get("before_start", {})
    at_start = len(result.time) and begin == result.time[0]
    return {s.name: float(known[column]) for column, s in chosen.items() if at_start and column in known}


def _algorithm(result: Result) -> Mapping[str, Any]:
    """What the run says of its algorithm; a measured table says nothing."""
    summary = result.summary if isinstance(result.summary, Mapping) else {}
    found: Mapping[str, Any] = summary.get("master", {}).get("algorithm", {})
    return found


def _is_run(result: Result) -> bool:
    """Whether it is a run of this package, which knows at which end of a step its signals were taken."""
    return "fresh" in _algorithm(result)


def _recorded(result: Result) -> dict[str, ColumnCourse]:
    """Columns of which the run says that they were held, or lines."""
    algorithm = _algorithm(result)
    found: dict[str, ColumnCourse] = {str(k).partition(" -> ")[0]: "held" for k in algorithm.get("held", ())}
    return found | dict(algorithm.get("played", {}))


def _chosen(result: Result, source: str, component: str | None, name: str) -> dict[str, SignalInfo]:
    """Columns to play back, with what they are, under their new names."""
    recorded = dict.fromkeys(s.name.partition(".")[0] for s in result.signals if "." in s.name)
    if component is not None and component not in recorded:
        hint = (
            nearest(component, recorded) if recorded else "its columns belong to no component, leave 'component' out."
        )
        raise ScenarioError(f"{source}: component {component!r} was not recorded there; {hint}")
    own = component or (name if name in recorded else None)
    prefix = "" if own is None else f"{own}."
    found = {s.name: replace(s, name=s.name.removeprefix(prefix)) for s in result.signals if s.name.startswith(prefix)}
    if not found:
        raise ScenarioError(f"{source}: there are no columns besides the time, so nothing can be played back.")
    return found


def _check_time(time: np.ndarray, source: str, span: tuple[float, float] | None) -> None:
    if not len(time):
        raise ScenarioError(f"{source}: there are no rows, so nothing can be played back.")
    if not np.all(np.isfinite(time)):
        raise ScenarioError(f"{source}: row {int(np.argmin(np.isfinite(time))) + 1}: the time is not a finite number.")
    back = np.flatnonzero(np.diff(time) < 0.0)
    if back.size:
        i = int(back[0])
        raise ScenarioError(
            f"{source}: time goes back from {time[i]:g} s to {time[i + 1]:g} s in row {i + 2}; sort the rows, or cut "
            f"the file."
        )
    if span is None:
        return
    start, stop = span
    if time[0] > start + TIME_TOLERANCE or time[-1] < stop - TIME_TOLERANCE:
        late = time[-1] < stop - TIME_TOLERANCE
        what = (
            f"ends at {time[-1]:g} s, the run at {stop:g} s"
            if late
            else f"begins at {time[0]:g} s, the run at {start:g} s"
        )
        raise ScenarioError(
            f"{source}: the recording {what}; set start and stop of the run within {time[0]:g} s to {time[-1]:g} s."
        )


def _rows(time: np.ndarray, span: tuple[float, float] | None) -> slice:
    """The rows that a run needs: from the last one before its start to the first one after its end."""
    if span is None:
        return slice(None)
    first = int(np.searchsorted(time, np.float64(span[0]) - TIME_TOLERANCE))
    if time[first] > span[0] + TIME_TOLERANCE:
        first = int(np.searchsorted(time, time[first - 1]))
    last = int(np.searchsorted(time, span[1] - TIME_TOLERANCE))
    return slice(first, int(np.searchsorted(time, max(time[last], span[1] + TIME_TOLERANCE), side="right")))


def _events(time: np.ndarray, values: np.ndarray, telegrams: np.ndarray) -> np.ndarray:
    """Times of events: there are rows before and after, of other values, or not for the sake of a telegram to somebody.

    A plant that returns early at an event may show its new values before the event already: others jump there all the
    same.

    Args:
        time: of the rows [s], shape (rows,). values: shape (rows, n). telegrams: when telegrams were delivered [s].
    """
    first = np.flatnonzero(np.diff(time, prepend=-np.inf))
    last = np.append(first[1:], len(time)) - 1
    several = first < last
    first, last = first[several], last[several]
    equal = (values[first] == values[last]) | (np.isnan(values[first]) & np.isnan(values[last]))
    differ = ~np.all(equal, axis=1)
    known = np.append(np.sort(telegrams[np.isfinite(telegrams)]), np.inf)  # NaN are those that were missed
    listed = known[np.searchsorted(known, time[first] - TIME_TOLERANCE)] <= time[first] + TIME_TOLERANCE
    return np.asarray(time[first][differ | ~listed])


def _without_gaps(values: np.ndarray, time: np.ndarray, interpolation: Interpolation) -> tuple[np.ndarray, str]:
    """The column, gaps filled where they may be, and why it cannot be played back, empty where it can."""
    good = np.isfinite(values)
    if good.all():
        return values, ""
    bad = int(np.argmin(good))
    if interpolation == "hold" and good[0]:
        return values[np.maximum.accumulate(np.where(good, np.arange(len(values)), 0))], ""
    fault = f"its value at {time[bad]:g} s is {values[bad]} ({int((~good).sum())} such of {len(values)})"
    hint = {
        "hold": "there is nothing before it to hold; can_be_missing says that filters leave it out",
        "linear": "can_be_missing says that filters leave it out; interpolation = 'hold' keeps the last value over "
        "gaps, and whoever samples takes it for a new one",
    }
    return values, f"{fault}; {hint[interpolation]}"
