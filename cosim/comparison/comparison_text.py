"""A comparison as text for a terminal and for the output of pytest: a table of signals, and what was found below it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import isnan, nan
from typing import Any

from cosim.comparison.verdict import Comparison, ComparisonFinding, EventComparison, SignalComparison
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
SPAN = ("starts_early", "starts_late", "ends_early", "ends_late", "gap")
FINDINGS_SHOWN, EVENTS_SHOWN, _FAILED_SHOWN = 4, 10, 40


def comparison_text(comparison: Comparison, verbose: bool = False) -> str:
    """See `comparison_parts`; as one text."""
    return joined(comparison_parts(comparison, verbose))


def comparison_parts(comparison: Comparison, verbose: bool = False) -> Parts:
    """A comparison for people: the verdict in a line first.

    Args:
        comparison: what was found.
        verbose: all signals, findings, telegrams and packets; else those that fail, a few findings each.
    """
    shared = _shared(comparison)
    shown = _shown(comparison, verbose, shared)
    limit = len(shown) if verbose else _FAILED_SHOWN
    more = [f"... and {len(shown) - limit} more signals that differ"] if len(shown) > limit else []
    parts: list[Table | str] = [_headline(comparison)]
    parts.append(replace(signals_table(shown[:limit]), notes=more))
    parts += [f"  all {count} signals: {text}" for text, count in shared.items()]
    for signal in shown[:limit]:
        parts += _details(signal, verbose, shared)
    parts += _events(comparison, verbose)
    return [*parts, "\n".join(f"note: {note}" for note in comparison.notes)]


def _shown(comparison: Comparison, verbose: bool, shared: Mapping[str, int]) -> list[SignalComparison]:
    failed = comparison.failed
    bad = {id(signal) for signal in failed}
    if verbose:
        return [*failed, *(s for s in comparison.signals if id(s) not in bad)]
    return [s for s in failed if s.status != "differs" or _own(s, shared)]


def _shared(comparison: Comparison) -> dict[str, int]:
    """What is so with all signals, such as a sample less at the end: text without the name of the signal, how many have
    it.
    """
    both = [signal for signal in comparison.signals if signal.status in ("equal", "within", "differs")]
    counts = Counter(f.text.removeprefix(s.name + ": ") for s in both for f in s.findings if f.kind in SPAN)
    return {text: count for text, count in counts.items() if count == len(both) > 1}


def _own(signal: SignalComparison, shared: Mapping[str, int]) -> list[ComparisonFinding]:
    return [finding for finding in signal.findings if finding.text.removeprefix(signal.name + ": ") not in shared]


def _headline(comparison: Comparison) -> str:
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
    return Table("signals", _COLUMNS, [_row(signal) for signal in signals], bad={_verdict(signal) for signal in failed})


def _row(signal: SignalComparison) -> list[Any]:
    compared = signal.status in ("equal", "within", "differs")
    at = signal.max_error_at if signal.max_error else nan
    errors = [signal.max_error, at, signal.allowed, signal.max_shift if compared else nan, signal.rms_error]
    return [signal.name, signal.unit or "1", *errors, signal.share_outside if compared else nan, _verdict(signal)]


def _verdict(signal: SignalComparison) -> str:
    kinds = dict.fromkeys(finding.kind.replace("_", " ") for finding in signal.findings)
    return VERDICTS.get(signal.status) or f"differs: {', '.join(kinds)}"


def _details(signal: SignalComparison, verbose: bool, shared: Mapping[str, int]) -> Parts:
    if signal.status == "missing":
        near = f"; nearest: {', '.join(signal.nearest)}" if signal.nearest else ""
        return [f"  {signal.name}: missing in the result{near}"]
    findings = _own(signal, shared)
    limit = len(findings) if verbose else FINDINGS_SHOWN
    lines = [f"  {finding.text}" for finding in findings[:limit]]
    if len(findings) > limit:
        lines.append(f"  {signal.name}: ... and {len(findings) - limit} more findings")
    points = signal.worst if any(finding.kind == "value" for finding in findings) else ()
    title = f"worst points of {signal.name}"
    return ["\n".join(lines), Table(title, _POINT_COLUMNS, points, title=f"  {title}:")]


def _events(comparison: Comparison, verbose: bool) -> list[str]:
    parts = []
    for what, events in (("telegrams", comparison.events), ("packets", comparison.packets)):
        differences = events.differences
        limit = len(differences) if verbose else EVENTS_SHOWN
        lines = [f"{what}:", *(f"  {difference.text}" for difference in differences[:limit])]
        if len(differences) > limit:
            lines.append(f"  ... and {len(differences) - limit} more")
        parts += ["\n".join(lines)] if differences else []
    return parts
