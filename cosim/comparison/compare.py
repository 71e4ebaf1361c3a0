"""Compare a result with a reference: signals in tolerance tubes, telegrams and packets as events."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Literal

import numpy as np

from cosim.comparison.comparison import Comparison
from cosim.comparison.curve import Curve, check_time, is_held
from cosim.comparison.curve_comparison import Task, compare_signal
from cosim.comparison.event_comparison import Event, compare_events, compare_telegrams
from cosim.comparison.points import instants_within
from cosim.comparison.tolerance import Tolerance, Tolerances
from cosim.comparison.verdict import ComparisonFinding, EventComparison, SignalComparison
from cosim.errors import ComparisonError, nearest
from cosim.results.load_result import load_result
from cosim.results.result import PacketRecord, Result, SignalInfo
from plant_models.hybrid.units import UnitError, conversion, parse_unit

StatedTolerance = Tolerance | Mapping[str, Any] | float
"""A tolerance as users write it, see `cosim.comparison.tolerance.tolerance`."""


_MOST_ROWS = 0.9
"""Share of the instants of the other side from which on both have about as many."""
_RUN_KEYS = ("scenario", "start", "stop", "step")
MODEL_KEYS = {"model": "is model", "fmi_version": "has FMI version", "preset": "has preset"}
GUID = {"guid": "has the GUID"}


def notes(reference: Result, result: Result, tolerances: Tolerances, labels: tuple[str, str]) -> list[str]:
    """Lines for people; empty where there is nothing to know.

    Args:
        reference: what was compared with.
        result: what was compared.
        tolerances: what is allowed, signal by signal.
        labels: what result and reference are called.
    """
    lines = [
        f"{label}: the run ended early: {side.failure}"
        for label, side in zip(labels, (reference, result), strict=True)
        if side.failure is not None
    ]
    bare = [_states_no_units(side) for side in (reference, result)]
    if bare[0] != bare[1]:
        without, with_units = labels if bare[0] else labels[::-1]
        lines.append(f"{without} names no units; its numbers were taken to be in those of {with_units}.")
    lines += _fewer_rows((reference.time, result.time), labels)
    lines += _components(reference.summary, result.summary, GUID)
    lines += run_differences(reference, result)
    names = list(dict.fromkeys([*_names(reference), *_names(result)]))
    lines += [
        f"The tolerance for {stated!r} fits no signal; {nearest(stated, names)}" for stated in tolerances.unused(names)
    ]
    return lines


def _fewer_rows(times: tuple[np.ndarray, np.ndarray], labels: tuple[str, str]) -> list[str]:
    """That one side has far fewer rows, so that not all rows of the other are compared."""
    counts = instants_within(*times), instants_within(*times[::-1])
    if not 0 < min(counts) < _MOST_ROWS * max(counts):
        return []
    few, many = labels if counts[0] < counts[1] else labels[::-1]
    return [f"Compared at {min(counts)} instants, those of {few}; {many} has {max(counts)}."]


def run_differences(reference: Result, result: Result) -> list[str]:
    """How what was run differs: models and parameters, then times, then versions; a line each.

    Args:
        reference: what was compared with.
        result: what was compared.
    """
    one, two = reference.summary, result.summary
    lines = [line for pair in _in_both(one, two) for line in _parameters(*pair)]
    lines += _components(one, two, MODEL_KEYS)
    lines += [
        f"{key}: {two[key]} instead of {one[key]}."
        for key in _RUN_KEYS
        if key in one and key in two and one[key] != two[key]
    ]
    return lines + _versions(one.get("versions"), two.get("versions"))


def _states_no_units(side: Result) -> bool:
    """Whether it is a mere table without any unit, as most CSV files are: not a run, whose pure numbers are meant
    so.
    """
    return "components" not in side.summary and all(info.unit in ("", "1") for info in side.signals)


def _versions(one: Any, two: Any) -> list[str]:
    if not isinstance(one, Mapping) or not isinstance(two, Mapping):
        return []
    other = [f"{name} {two[name]} instead of {one[name]}" for name in one if name in two and one[name] != two[name]]
    return [f"Other versions: {', '.join(other)}."] if other else []


def _components(one: Mapping[str, Any], two: Mapping[str, Any], words: Mapping[str, str]) -> list[str]:
    """What components of both runs say otherwise under the keys of `words`."""
    return [
        f"{before['name']} {verb} {now[key]} instead of {before[key]}."
        for before, now in _in_both(one, two)
        for key, verb in words.items()
        if key in before and key in now and before[key] != now[key]
    ]


def _in_both(one: Mapping[str, Any], two: Mapping[str, Any]) -> list[tuple[Mapping[str, Any], Mapping[str, Any]]]:
    """What the two runs state of their common components."""
    sides = one.get("components"), two.get("components")
    if not all(map(_is_list, sides)):
        return []
    known = {entry["name"]: entry for entry in sides[1] or ()}
    return [(entry, known[entry["name"]]) for entry in sides[0] or () if entry["name"] in known]


def _parameters(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    one, two, name = before.get("parameters"), now.get("parameters"), before["name"]
    if not isinstance(one, Mapping) or not isinstance(two, Mapping) or one == two:
        return []
    return [
        f"Parameter {name}.{key} is {two.get(key, 'its default')} instead of {one.get(key, 'its default')}."
        for key in {**one, **two}
        if str(one.get(key)) != str(two.get(key))
    ]


def _is_list(entries: Any) -> bool:
    return isinstance(entries, Iterable) and all(isinstance(e, Mapping) and "name" in e for e in entries)


def _keeps_packets(result: Result) -> bool:
    """Whether a result would have packets if there had been any: a folder does, a file or a baseline does not."""
    return bool(result.packets) or ("components" in result.summary and "events_recorded" not in result.summary)


def _compare_packets(reference: Result, result: Result, tolerance: Tolerance, length: float) -> EventComparison:
    """Compare two lists of packets. Numbers say which belong together, and what is left the nearest stamp.

    Args:
        reference, result: whose packets. tolerance: of times and values. length: of the reference [s].
    """
    sides = (reference, result)
    if any(side.packets for side in sides) and not all(map(_keeps_packets, sides)):
        return EventComparison(compared=False)
    ours, theirs = ([_event(packet) for packet in side.packets] for side in sides)
    return compare_events(ours, theirs, tolerance, length)


def _event(packet: PacketRecord) -> Event:
    return Event(
        packet,
        f"packet {packet.number} of {packet.node!r} ({packet.kind}) of {packet.stamp:.9g} s",
        {"node": packet.node, "number": str(packet.number), "kind": packet.kind},
        {"sent": packet.stamp, "delivered": packet.delivered_at},
        packet.values,
        packet.outcomes,
    )


def compare_results(
    reference: Result,
    result: Result,
    tolerances: Tolerances | None = None,
    *,
    labels: tuple[str, str] = ("reference", "result"),
    extra_fails: bool = False,
    curves: bool = True,
) -> Comparison:
    """Compare two results.

    Args:
        reference: what is right. result: what is compared with it.
        tolerances: the default ones if left out.
        labels: what the two are called in messages.
        extra_fails: whether signals that only the result has count as a difference.
        curves: whether to keep what pictures need; False saves time and memory.

    Returns:
        One entry for each signal, the telegrams, the packets, and notes.

    Raises:
        ComparisonError: a run is empty, its times fall, or the two have no signal or no time in common.
    """
    tolerances = tolerances or Tolerances()
    for side, label in zip((reference, result), labels, strict=True):
        check_time(side.time, label)
    ours, theirs = _names(reference), _names(result)
    _check_common(reference, result, tolerances, labels)
    known = set(ours)
    extra = [name for name in theirs if name not in known]
    pair = _Pair(reference, result, tolerances, curves, extra)
    with np.errstate(over="ignore", invalid="ignore"):  # infinities, and numbers so large that their differences are
        signals = [pair.compare(name) for name in ours] + [pair.lone(name, "extra") for name in extra]
    return Comparison(
        *labels,
        signals,
        compare_telegrams(reference, result, tolerances.default, pair.length),
        [*(s.remark for s in signals if s.remark), *notes(reference, result, tolerances, labels)],
        extra_fails,
        _compare_packets(reference, result, tolerances.default, pair.length),
    )


def compare(
    reference: Any,
    result: Any,
    tolerance: StatedTolerance | None = None,
    *,
    tolerances: Mapping[str, StatedTolerance] | None = None,
    ignore: Iterable[str] = (),
    extra_fails: bool = False,
) -> Comparison:
    """Compare two results, outcomes, or files and folders that hold results.

    Args:
        reference, result: `Result`, `Outcome`, or the path of a results folder or of a table.
        tolerance: for all signals: a `Tolerance`, some of its keys, or a number, the share of the range of the signal.
        tolerances: by name or pattern (``train.*``) of the signal, in its SI unit.
        ignore: names or patterns of signals that are not compared.
        extra_fails: whether signals that only the result has count as a difference.

    Raises:
        ComparisonError: see `compare_results`; or not a result, or an impossible tolerance.
        OutputError: a file cannot be read.
    """
    allowed = Tolerances.of(tolerance, tolerances, ignore)
    labels = _label_of(reference, "reference"), _label_of(result, "result")
    return compare_results(_result_of(reference), _result_of(result), allowed, labels=labels, extra_fails=extra_fails)


def _label_of(stated: Result | str | Path | Any, otherwise: str) -> str:
    """What a result is called in messages."""
    return str(stated) if isinstance(stated, str | Path) else otherwise


def _result_of(stated: Any) -> Result:
    if isinstance(stated, str | Path):
        return load_result(stated)
    held = getattr(stated, "result", stated)
    if not isinstance(held, Result):
        what = f"{type(stated).__module__}.{type(stated).__qualname__}"
        raise ComparisonError(f"Cannot compare a {what}; expected a Result, an Outcome, or the path of a result.")
    return held


def _names(side: Result) -> list[str]:
    return list(side.table.dtype.names or ())[1:]


def _check_common(reference: Result, result: Result, tolerances: Tolerances, labels: tuple[str, str]) -> None:
    ours, theirs = _names(reference), _names(result)
    known = set(theirs)
    common = [name for name in ours if name in known]
    if not common:
        near = _nearest(ours[0], theirs) if ours else []
        hint = f" {labels[0]} has {ours[0]!r}, nearest in {labels[1]}: {', '.join(map(repr, near))}." if near else ""
        raise ComparisonError(
            f"Nothing to compare: none of the {len(ours)} signals of {labels[0]} is among the {len(theirs)} of "
            f"{labels[1]}.{hint}"
        )
    if all(tolerances.ignores(name) for name in common):
        raise ComparisonError(f"Nothing to compare: all {len(common)} common signals are ignored.")
    first, last = max(reference.time[0], result.time[0]), min(reference.time[-1], result.time[-1])
    if first > last + tolerances.default.time_for(float(np.ptp(reference.time))):
        spans = [
            f"{label} {s.time[0]:.9g} to {s.time[-1]:.9g} s"
            for label, s in zip(labels, (reference, result), strict=True)
        ]
        raise ComparisonError(f"Nothing to compare: no time in common ({', '.join(spans)}).")


def _nearest(name: str, known: Iterable[str]) -> list[str]:
    """Names that look like it as a whole, or whose last part does."""
    names = list(known)
    last = name.rpartition(".")[2]
    whole = get_close_matches(name, names, 3, 0.6)
    parts = [n for n in names if get_close_matches(last, [n.rpartition(".")[2]], 1, 0.8)]
    return list(dict.fromkeys(whole + parts))[:3]


def curve_of(side: Result, name: str) -> Curve:
    """A signal of a result as a curve.

    Args:
        side: the result. name: of the signal.
    """
    values = np.asarray(side[name], dtype=float)
    info = next((info for info in side.signals if info.name == name), SignalInfo(name))
    return Curve(np.asarray(side.time, dtype=float), values, info.variability == "discrete" or is_held(values))


class _Pair:
    """Two results whose signals are compared one by one."""

    def __init__(
        self, reference: Result, result: Result, tolerances: Tolerances, curves: bool, extra: list[str]
    ) -> None:
        self.results = (reference, result)
        self.tolerances, self.curves, self.extra = tolerances, curves, extra
        self.length = float(reference.time[-1] - reference.time[0])
        self.rows = [_rows_to_keep(side.time) for side in self.results]
        self.times = [np.asarray(s.time[k], dtype=float) for s, k in zip(self.results, self.rows, strict=True)]
        self.infos = [{info.name: info for info in side.signals} for side in self.results]
        self.has = set(_names(result))
        self.bare = [_states_no_units(side) for side in self.results]

    def compare(self, name: str) -> SignalComparison:
        """The comparison of a signal of the reference."""
        if self.tolerances.ignores(name) or name not in self.has:
            return self.lone(name, "missing")
        one, two = (infos.get(name, SignalInfo(name)) for infos in self.infos)
        if any(self.bare):
            one, two = (replace(info, unit=(two if self.bare[0] else one).unit) for info in (one, two))
        try:
            factor, offset = (
                (1.0, 0.0) if one.unit == two.unit else conversion(parse_unit(two.unit), parse_unit(one.unit))
            )
        except UnitError as error:
            return self._other_unit(name, one.unit, two.unit, str(error))
        values = [np.asarray(side[name][rows], dtype=float) for side, rows in zip(self.results, self.rows, strict=True)]
        if (factor, offset) != (1.0, 0.0):
            values[1] = factor * values[1] + offset
        held = "discrete" in (one.variability, two.variability) or all(map(is_held, values))
        reference, result = (Curve(time, v, held) for time, v in zip(self.times, values, strict=True))
        tolerance, allowed = self.tolerances.for_signal(name), self.tolerances.value_for(name, reference)
        shown = two.shown if self.bare[0] else one.shown
        return compare_signal(Task(name, shown, reference, result, tolerance, allowed, self.length, self.curves))

    def lone(self, name: str, status: Literal["missing", "extra"]) -> SignalComparison:
        """The entry of a signal that only one side has, or that is ignored."""
        info = self.infos[0 if status == "missing" else 1].get(name, SignalInfo(name))
        tolerance = self.tolerances.for_signal(name)
        if self.tolerances.ignores(name):
            return SignalComparison(name, info.unit, "ignored", tolerance, shown_in=info.shown)
        near = [*_nearest(name, self.extra), *_nearest(name, self.has)] if status == "missing" else []
        equal = self._equal_values(name) if status == "missing" else ""
        near = list(dict.fromkeys(near))[:3]
        return SignalComparison(
            name, info.unit, status, tolerance, nearest=near, equal_values=equal, shown_in=info.shown
        )

    def _equal_values(self, name: str) -> str:
        """A signal that only the result has, and that is this one but for its name; or an empty text."""
        reference, result = self.results
        if len(reference.time) != len(result.time):
            return ""
        values = np.asarray(reference[name], dtype=float)
        limit = self.tolerances.value_for(name, curve_of(reference, name))
        if not np.any(np.abs(values) > limit):
            return ""  # zeros have no name
        fits = (n for n in self.extra if np.all(np.abs(np.asarray(result[n], dtype=float) - values) <= limit))
        return next(fits, "")

    def _other_unit(self, name: str, one: str, two: str, why: str) -> SignalComparison:
        text = f"{name}: the result is in {two or '1'}, the reference in {one or '1'}; not compared: {why}"
        begin, end, nan = float(self.times[0][0]), float(self.times[0][-1]), float("nan")
        finding = ComparisonFinding("unit", begin, end, nan, nan, float("inf"), 0.0, text)
        return SignalComparison(name, one, "differs", self.tolerances.for_signal(name), findings=[finding])


def _rows_to_keep(time: np.ndarray) -> np.ndarray:
    """Which rows count: of several with one time the first and the last, before and after all events of that
    instant.

    Args:
        time: [s], shape (rows,), never falling.
    """
    keep = np.ones(len(time), dtype=bool)
    if len(time) > 2:
        keep[1:-1] = (time[1:-1] > time[:-2]) | (time[2:] > time[1:-1])
    return keep
