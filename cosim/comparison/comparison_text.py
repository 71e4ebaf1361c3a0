"""A comparison as text for a terminal and for the output of pytest: a table of signals, and what was found below it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from math import isnan

from cosim.comparison.verdict import Comparison, ComparisonFinding, EventComparison, SignalComparison
from fmus.text_table import text_table

HEAD = ("signal", "unit", "max error", "at [s]", "allowed", "shift [s]", "outside", "verdict")
SPAN = ("starts_early", "starts_late", "ends_early", "ends_late", "gap")
_LONGEST_NAME = 48
FINDINGS_SHOWN, EVENTS_SHOWN, _FAILED_SHOWN = 4, 10, 40


def comparison_text(comparison: Comparison, verbose: bool = False) -> str:
    """A comparison for people.

    Args:
        comparison: what was found.
        verbose: all signals, findings, telegrams and packets; else those that fail, a few findings each.
    """
    shared = _shared(comparison)
    shown = _shown(comparison, verbose, shared)
    limit = len(shown) if verbose else _FAILED_SHOWN
    lines = [_headline(comparison)]
    if shown:
        lines += ["", *_table(shown[:limit])]
    if len(shown) > limit:
        lines.append(f"... and {len(shown) - limit} more signals that differ")
    for text, count in shared.items():
        lines += ["", f"  all {count} signals: {text}"]
    for signal in shown[:limit]:
        lines += _details(signal, verbose, shared)
    lines += _events(comparison, verbose)
    if comparison.notes:
        lines += ["", *(f"note: {note}" for note in comparison.notes)]
    return "\n".join(lines)


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


def _table(signals: Sequence[SignalComparison]) -> list[str]:
    return text_table([HEAD, *(_row(signal) for signal in signals)], left=(0, 1, 7), heading=True)


def _row(signal: SignalComparison) -> tuple[str, ...]:
    name = signal.name if len(signal.name) <= _LONGEST_NAME else f"...{signal.name[3 - _LONGEST_NAME :]}"
    share = "" if isnan(signal.max_error) else f"{100.0 * signal.share_outside:.3g} %"
    shift = f"{signal.max_shift:.3g}" if signal.max_shift else ""
    numbers = [
        _number(signal.max_error, "3"),
        _number(signal.max_error_at, "7") if signal.max_error else "",
        _number(signal.allowed, "3"),
    ]
    return (name, signal.unit or "1", *numbers, shift, share, _verdict(signal))


def _verdict(signal: SignalComparison) -> str:
    if signal.status != "differs":
        return signal.status
    return "differs: " + ", ".join(dict.fromkeys(finding.kind.replace("_", " ") for finding in signal.findings))


def _number(value: float, digits: str) -> str:
    return "" if isnan(value) else f"{value:.{digits}g}"


def _details(signal: SignalComparison, verbose: bool, shared: Mapping[str, int]) -> list[str]:
    if signal.status == "missing":
        near = f"; nearest: {', '.join(signal.nearest)}" if signal.nearest else ""
        return ["", f"  {signal.name}: missing in the result{near}"]
    findings = _own(signal, shared)
    if not findings:
        return []
    limit = len(findings) if verbose else FINDINGS_SHOWN
    lines = ["", *(f"  {finding.text}" for finding in findings[:limit])]
    if len(findings) > limit:
        lines.append(f"  {signal.name}: ... and {len(findings) - limit} more findings")
    if any(finding.kind == "value" for finding in findings):
        points = [[f"{t:.9g}", f"{a:.8g}", f"{b:.8g}", f"{e:+.4g}"] for t, a, b, e in signal.worst]
        table = text_table([["time [s]", "reference", "result", "error"], *points], left=())
        lines += ["    worst points:", *(f"      {line}" for line in table)]
    return lines


def _events(comparison: Comparison, verbose: bool) -> list[str]:
    lines: list[str] = []
    for what, events in (("telegrams", comparison.events), ("packets", comparison.packets)):
        differences = events.differences
        limit = len(differences) if verbose else EVENTS_SHOWN
        if differences:
            lines += ["", f"{what}:", *(f"  {difference.text}" for difference in differences[:limit])]
        if len(differences) > limit:
            lines.append(f"  ... and {len(differences) - limit} more")
    return lines
