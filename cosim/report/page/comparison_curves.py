"""The curves of a comparison for its page: both sides, the tube around the reference, the error in its band, and where
it is worst. Imports NumPy only.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from cosim.comparison.comparison import Comparison
from cosim.comparison.verdict import Curves, SignalComparison
from cosim.report.live.live_page import Mark, PageCurve, PagePanel, PageRecording

TUBE, ERROR = "tolerance tube", "result minus reference"
_DRAWN = 12  # panels of signals that differ; the others are in the list of signals
_LOWER, _UPPER, _BELOW, _ABOVE, _OFF = "lower", "upper", "least allowed", "most allowed", "error"


def comparison_recordings(comparison: Comparison) -> list[PageRecording]:
    """Both sides of all signals with curves; of those that differ most tube and error, too.

    Args:
        comparison: what to show.
    """
    sides: dict[tuple[str, bytes], tuple[np.ndarray, list[PageCurve]]] = {}
    for signal in comparison.signals:
        if signal.curves is not None:
            for label, time, curve in _both(comparison, signal, signal.curves):
                sides.setdefault((label, time.tobytes()), (time, []))[1].append(curve)
    recordings = [PageRecording(label, time, curves) for (label, _), (time, curves) in sides.items()]
    for signal in _worst(comparison):
        if signal.curves is not None:
            recordings += _tube_and_error(signal, signal.curves)
    return [recording for recording in recordings if len(recording.x)]


def _both(
    comparison: Comparison, signal: SignalComparison, curves: Curves
) -> Iterator[tuple[str, np.ndarray, PageCurve]]:
    yield (
        comparison.reference,
        curves.reference_time,
        PageCurve(signal.name, curves.reference, signal.unit, look="true", shown=signal.shown),
    )
    result = PageCurve(signal.name, curves.result, signal.unit, shown=signal.shown)
    yield comparison.result, curves.result_time, result


def _worst(comparison: Comparison) -> list[SignalComparison]:
    return [signal for signal in comparison.failed if signal.curves is not None][:_DRAWN]


def _tube_and_error(signal: SignalComparison, curves: Curves) -> Iterator[PageRecording]:
    """The tube, whose pieces are parted by gaps; the error; the band that it may lie in."""
    name, unit, shown = signal.name, signal.unit, signal.shown
    difference = replace(shown, offset=0.0)
    gap = np.isnan(curves.tube_time)
    if not gap.all() and len(gap):
        places = np.maximum.accumulate(np.where(gap, 0, np.arange(len(gap))))
        lower, upper = (np.where(gap, np.nan, edge) for edge in (curves.lower, curves.upper))
        time = np.maximum.accumulate(np.where(gap, -np.inf, curves.tube_time)[places])
        edges = [(f"{name} {_LOWER}", lower), (f"{name} {_UPPER}", upper)]
        drawn = [PageCurve(n, v, unit, look="allowed", label=n.removeprefix(f"{name} "), shown=shown) for n, v in edges]
        yield PageRecording(TUBE, time, drawn)
    if len(curves.error_time):
        error = PageCurve(f"{name} {_OFF}", curves.error, unit, label=ERROR, shown=difference)
        yield PageRecording(ERROR, curves.error_time, [error])
    ends = [t for t in (curves.reference_time, curves.result_time) if len(t)]
    if curves.allowed > 0.0 and ends:
        span = np.array([min(t[0] for t in ends), max(t[-1] for t in ends)])
        band = [(f"{name} {_BELOW}", -curves.allowed), (f"{name} {_ABOVE}", curves.allowed)]
        text = {n: n.removeprefix(f"{name} ") for n, _ in band}
        drawn = [PageCurve(n, np.full(2, v), unit, look="allowed", label=text[n], shown=difference) for n, v in band]
        yield PageRecording("allowed", span, drawn)


def comparison_panels(comparison: Comparison) -> list[PagePanel]:
    """For each of the signals that differ most both sides in the tube, and the error in its band; those of the worst
    are shown at first. Without any, the first signals.

    Args:
        comparison: what to show.
    """
    panels = []
    for place, signal in enumerate(_worst(comparison)):
        name = signal.name
        tube, band = [f"{name} {_LOWER}", f"{name} {_UPPER}"], [f"{name} {_BELOW}", f"{name} {_ABOVE}"]
        panels.append(PagePanel(name, [*tube, name], bands=[(tube[0], tube[1])], is_shown=place == 0, is_whole=True))
        panels.append(
            PagePanel(
                f"{name}: error",
                [*band, f"{name} {_OFF}"],
                bands=[(band[0], band[1])],
                is_shown=place == 0,
                is_whole=True,
            )
        )
    drawable = [signal.name for signal in comparison.signals if signal.curves is not None]
    return panels or [PagePanel(name, [name]) for name in drawable[:2]]


def comparison_marks(comparison: Comparison) -> list[Mark]:
    """Where signals differ, the worst points first; telegrams that differ.

    Args:
        comparison: what to show.
    """
    marks = []
    for signal in comparison.failed:
        finding = next((f for f in signal.findings if np.isfinite(f.time)), None)
        if finding is not None:
            worst = finding.worst if np.isfinite(finding.worst) else finding.time
            marks.append(
                Mark(
                    "worst",
                    worst,
                    f"{signal.name}: {finding.text.removeprefix(f'{signal.name}: ')}",
                    None,
                    signal.name,
                    _height(signal, worst),
                )
            )
    for signal in comparison.failed:
        for finding in signal.findings:
            if np.isfinite(finding.time):
                end = finding.end if np.isfinite(finding.end) and finding.end > finding.time else None
                marks.append(Mark("outside", finding.time, finding.text, end, signal.name))
    records = [(d.text, d.reference or d.result) for d in comparison.event_differences]
    return [*marks, *(Mark("telegram", record.stamp, text) for text, record in records if record is not None)]


def _height(signal: SignalComparison, time: float) -> float | None:
    """Value of the result at an instant, None where it has none."""
    curves = signal.curves
    if curves is None or not len(curves.result_time):
        return None
    row = int(np.argmin(np.abs(curves.result_time - time)))
    return float(curves.result[row]) if np.isfinite(curves.result[row]) else None
