"""A comparison as text for a terminal and for the output of pytest: a table of signals, and what was found below it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import isnan, nan
from typing import Any

from cosim.comparison.common_change import common_changes
from cosim.comparison.verdict import SPAN, ComparisonData, ComparisonFinding, EventComparison, SignalComparison
from fmus.tables.numbers import DASH
from fmus.tables.table import Column, Parts, Table, joined, name_column, text_column


def _instant(value: float) -> str:
    return DASH if isnan(value) else f"{value:.7g}"


_COLUMNS = (
    name_column("signal", "Signal"),
    text_column("unit", "Unit"),
    Column("max_error", "Largest error", "", "Of result minus reference"),
    Column("max_error_at", "At", "s", "Where it is largest", write=_instant),
    Column("allowed", "Allowed", "", "Where the error is largest"),
    Column("max_shift", "Largest shift", "s", "Of instants", short="Shift"),
    Column("share_of_range", "Of range", "%", "Largest error as a share of the range of the reference", factor=100.0),
    Column("rms_error", "Error, rms"),
    Column("share_outside", "Outside", "%", "Share of the time outside the tolerance", factor=100.0),
    text_column("verdict", "Verdict"),
)
VERDICTS = {
    "equal": "equal to the bit",
    "within": "within tolerance",
    "missing": "missing in the result",
    "extra": "only in the result",
    "ignored": "not compared",
}
_POINT_COLUMNS = (
    Column("time", "time", "s", write="{:.9g}".format),
    Column("reference", "reference", write="{:.8g}".format),
    Column("result", "result", write="{:.8g}".format),
    Column("error", "error", write="{:+.4g}".format),
)
MOST_LINES = 32
"""Of a comparison where not all is asked for: pytest adds the baseline and where the pages are, and 40 fit a screen."""
_FIRST_CAUSES, _CHANGES, _ROWS, _NOTES = 3, 3, 6, 4
_NOTES_OF_EQUAL = 10
_ALL = 10**9


def comparison_text(comparison: ComparisonData, verbose: bool = False) -> str:
    """See `comparison_parts`; as one text."""
    return joined(comparison_parts(comparison, verbose))


def comparison_parts(comparison: ComparisonData, verbose: bool = False) -> Parts:
    """A comparison for people: what was different in what was run, the verdict in a line, and the other parts of
    `difference_parts`.

    Args:
        comparison: what was found.
        verbose: all signals, findings, telegrams and packets; else what fits `MOST_LINES`, the worst first.
    """
    causes, *others = difference_parts(comparison, verbose)
    verdict = comparison_verdict(comparison)
    return [verdict, causes, *others] if comparison.equal else [joined([f"{causes}\n{verdict}".lstrip()]), *others]


def difference_parts(comparison: ComparisonData, verbose: bool = False) -> Parts:
    """A comparison without its verdict: what was different in what was run, what the differences have in common, how
    large they are, and where.

    Args:
        comparison, verbose: as for `comparison_parts`.
    """
    shared = _shared(comparison)
    shown = _shown(comparison, verbose, shared)
    common = [*(change.text for change in common_changes(comparison))]
    common += [f"all {count} signals: {text}" for text, count in shared.items()]
    table = _worst_signals(shown, _ALL if verbose else _ROWS)
    others = [f"note: {note}" for note in comparison.notes if note not in comparison.causes]
    most_notes = _ALL if verbose else _NOTES_OF_EQUAL if comparison.equal else _NOTES
    notes = "\n".join(_first(others, most_notes, "notes"))
    changes = "\n".join(f"  {line}" for line in _first(common, _ALL if verbose else _CHANGES, "changes"))
    above: list[Table | str] = [_causes(comparison, _ALL if verbose else _FIRST_CAUSES), changes, table]
    room = _ALL if verbose else MOST_LINES - len(joined([*above, notes]).splitlines()) - 3
    return [*above, *_symptoms(comparison, shown, shared, verbose, room), notes]


def _causes(comparison: ComparisonData, most: int) -> str:
    """What was different in what was run."""
    if comparison.equal:
        return "\n".join(f"note: {cause}" for cause in comparison.causes[:most])
    return "\n".join(_first(comparison.causes, most, "differences of what was run"))


def _first(lines: Sequence[str], most: int, what: str) -> list[str]:
    """The first of some lines, and how many more there are."""
    return list(lines) if len(lines) <= most else [*lines[: most - 1], f"... and {len(lines) - most + 1} more {what}"]


def _worst_signals(shown: Sequence[SignalComparison], most: int) -> Table:
    more = [f"... and {len(shown) - most} more signals that differ"] if len(shown) > most else []
    return replace(signals_table(shown[:most]), notes=more)


def _symptoms(
    comparison: ComparisonData,
    shown: Sequence[SignalComparison],
    shared: Mapping[str, int],
    verbose: bool,
    room: int,
) -> Parts:
    """Where and how signals, telegrams and packets differ: a line for each, then the worst points as far as there is
    room.
    """
    if verbose:
        details = [part for signal in shown for part in _details(signal, shared)]
        return [*details, *_events(comparison, _ALL)]
    lines = [line for signal in shown for line in _findings(signal, shared)[:1]]
    events = ["\n".join(text.splitlines()) for text in _events(comparison, max(2, room // 2))]
    left = room - sum(len(text.splitlines()) + 1 for text in events)
    findings = "\n".join(_first(lines, max(2, left), "lines: see --verbose"))
    points: Table | str = next((found for signal in shown if (found := _points(signal, shared))), "")
    needed = len(joined([findings, points]).splitlines()) + 1
    return [findings, *([points] if needed <= left else []), *events]


def _shown(comparison: ComparisonData, verbose: bool, shared: Mapping[str, int]) -> list[SignalComparison]:
    failed = comparison.failed
    bad = {id(signal) for signal in failed}
    if verbose:
        return [*failed, *(s for s in comparison.signals if id(s) not in bad)]
    return [s for s in failed if s.status != "differs" or _own(s, shared)]


def _shared(comparison: ComparisonData) -> dict[str, int]:
    """What is so with all signals, such as a sample less at the end: text without the name of the signal, how many have
    it.
    """
    both = [signal for signal in comparison.signals if signal.status in ("equal", "within", "differs")]
    counts = Counter(f.text.removeprefix(s.name + ": ") for s in both for f in s.findings if f.kind in SPAN)
    return {text: count for text, count in counts.items() if count == len(both) > 1}


def _own(signal: SignalComparison, shared: Mapping[str, int]) -> list[ComparisonFinding]:
    return [finding for finding in signal.findings if finding.text.removeprefix(signal.name + ": ") not in shared]


def comparison_verdict(comparison: ComparisonData) -> str:
    """Whether the result is as the reference, and how many signals and telegrams are, in a line.

    Args:
        comparison: what was found.
    """
    statuses = [signal.status for signal in comparison.signals]
    words = {
        "equal": "equal",
        "within": "within tolerance",
        "differs": "differ",
        "missing": "missing",
        "extra": "extra",
        "ignored": "ignored",
    }
    counts = [f"{statuses.count(s)} {word}" for s, word in words.items() if s in statuses]
    events = _events_text("telegrams", comparison.events)
    packets = comparison.packets
    if packets.matched or packets.differences or not packets.compared:
        events += f"; {_events_text('packets', packets)}"
    verdict = "agrees with" if comparison.equal else "DIFFERS from"
    return f"{comparison.result} {verdict} {comparison.reference}: {', '.join(counts)}; {events}."


def _events_text(what: str, events: EventComparison) -> str:
    if not events.compared:
        return f"{what} not compared: one side keeps none"
    if events.differences:
        return f"{events.matched} {what} paired, {len(events.differences)} differences"
    return f"{events.matched} {what} match"


def signals_table(signals: Sequence[SignalComparison], failed: Sequence[SignalComparison] = ()) -> Table:
    """Errors and verdicts of signals.

    Args:
        signals: in the order in which they are shown. failed: of them, those that stand out on a page.
    """
    return Table(
        "signals",
        _COLUMNS,
        [_row(signal.as_shown()) for signal in signals],
        bad={_verdict(signal) for signal in failed},
    )


def _row(signal: SignalComparison) -> list[Any]:
    compared = signal.status in ("equal", "within", "differs")
    at = signal.max_error_at if signal.max_error else nan
    shift = signal.max_shift if compared else nan
    errors = [signal.max_error, at, signal.allowed, shift, signal.share_of_range, signal.rms_error]
    return [signal.name, signal.unit or "1", *errors, signal.share_outside if compared else nan, _verdict(signal)]


def _verdict(signal: SignalComparison) -> str:
    kinds = dict.fromkeys(finding.kind.replace("_", " ") for finding in signal.findings)
    return VERDICTS.get(signal.status) or f"differs: {', '.join(kinds)}"


def _findings(signal: SignalComparison, shared: Mapping[str, int]) -> list[str]:
    """What was found of a signal, the worst first, a line each."""
    if signal.status == "missing":
        return [f"  {signal.name}: missing in the result{signal.hint}"]
    return [f"  {finding.text}" for finding in _own(signal, shared)]


def _points(signal: SignalComparison, shared: Mapping[str, int]) -> Table | str:
    """The worst points of a signal whose values differ."""
    points = signal.as_shown().worst if any(finding.kind == "value" for finding in _own(signal, shared)) else ()
    title = f"worst points of {signal.name}"
    return Table(title, _POINT_COLUMNS, points, title=f"  {title}:") if points else ""


def _details(signal: SignalComparison, shared: Mapping[str, int]) -> Parts:
    return ["\n".join(_findings(signal, shared)), _points(signal, shared)]


def _events(comparison: ComparisonData, most: int) -> list[str]:
    """Telegrams and packets that differ, in `most` lines together at most, as far as there is one for each."""
    kinds = [("telegrams", comparison.events), ("packets", comparison.packets)]
    lists = [(what, [f"  {d.text}" for d in events.differences]) for what, events in kinds if events.differences]
    share = max(1, most // max(1, len(lists)) - 2)
    return ["\n".join([f"{what}:", *_first(lines, share, what)]) for what, lines in lists]
