"""Figures of the gaps between balises: how long they were beside the gaps the observers are certified for, and how far
observers were off at their end. Draw on axes given, or on their own.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from cosim.drawing.style import BLACK, GAP, MARK, observer_line
from cosim.evaluation.balise_gaps import PLAIN_ODOMETER, envelope, gap_errors
from cosim.evaluation.event_counts import accepted_stamps
from cosim.evaluation.roles import label
from cosim.evaluation.spec import ReportSpec
from cosim.evaluation.summary_entries import certified_gap, mapping_entry
from cosim.report.figures.drawing import logarithmic, shade_zones
from cosim.report.figures.panel import Panel
from cosim.report.figures.scales import bounded
from cosim.results.result import Result
from fmus.tables.numbers import number

SMALLEST, LARGEST = 1e-2, 1e3  # [m]; errors beyond are drawn at the edge
MARKERS = "os^Dv<>p"
_MARK_STYLE: dict[str, Any] = {"linestyle": "none", "markersize": 4.5, "markeredgewidth": 1.0, "alpha": 0.75}
_GRANTED = "SUBSET-041 (5 m + 5 %)"
SHOWN = 3.0  # limits above this many largest gaps are named, not drawn


def _sampling_gaps(result: Result) -> tuple[np.ndarray, np.ndarray]:
    """Time between consecutive balises that were used.

    Args:
        result: the run.

    Returns:
        Times of the balises [s], shape (n,), and the gaps between them [s], shape (n - 1,), or empty without two
        balises.
    """
    stamps = np.array(accepted_stamps(result.events))
    return stamps, np.diff(stamps)


def _certified_gaps(result: Result, spec: ReportSpec) -> dict[str, float]:
    """Largest gap each observer is certified for when the gaps vary [s]; observers without a finite limit are left
    out.
    """
    certificates = mapping_entry(result, "certificates")
    limits = {}
    for observer in spec.observers:
        entry = certificates.get(observer)
        limit = certified_gap(entry) if isinstance(entry, Mapping) else None
        if limit is not None:
            limits[observer] = limit
    return limits


class GapsPanel(Panel):
    """Time between consecutive balises in s, each gap over the time it lasts, and the certified gaps as levels."""

    name = "gaps"
    title = "Sampling gaps"
    caption = (
        "Time between consecutive balises that were used, beside the largest varying gap each observer is "
        "certified for."
    )
    place = 6
    size = (8.2, 3.0)

    @classmethod
    def plot(cls, result: Result, spec: ReportSpec, ax: Axes) -> None:  # noqa: D102 - see Panel
        stamps, gaps = _sampling_gaps(result)
        limits = _certified_gaps(result, spec)
        shade_zones(ax, spec)
        top = float(np.max(gaps)) if len(gaps) else max(limits.values(), default=1.0)
        if len(gaps):
            ax.stairs(gaps, stamps, fill=True, color=GAP, label="gap between balises")
        largest = top
        for limit in sorted(set(limits.values())):
            observers = [observer for observer in limits if limits[observer] == limit]
            line = observer_line(spec.observers, observers[0])
            text = f"certified to {number(limit)} s: {', '.join(label(spec, observer) for observer in observers)}"
            if len(gaps) and largest > limit:
                text += " (exceeded)"
            if limit <= SHOWN * largest:
                ax.axhline(limit, label=text, **line)
                top = max(top, limit)
            else:
                ax.plot([], [], label=f"{text} (above the scale)", **line)
        ax.set_ylim(0.0, 1.12 * top)
        ax.set_ylabel("Sampling gap [s]")

    @classmethod
    def available(cls, result: Result, spec: ReportSpec) -> bool:  # noqa: ARG003, D102 - see Panel
        return len(_sampling_gaps(result)[1]) > 0


class GapErrorsPanel(Panel):
    """Magnitude of the position error [m] at the end of each gap over its length, on a logarithmic axis, for every
    observer and the plain odometer, with the envelope of SUBSET-041.
    """

    name = "gap_errors"
    title = "Position errors at the end of the gaps"
    caption = (
        "How far each observer and the plain odometer were off when the next balise was read, over the way since the "
        "last one. The line is what SUBSET-041 grants an odometer; smaller than 1 cm and larger than 1 km are drawn at "
        "the edge."
    )
    place = 7
    size = (8.2, 3.8)
    over_time = False

    @classmethod
    def plot(cls, result: Result, spec: ReportSpec, ax: Axes) -> None:  # noqa: D102 - see Panel
        found = gap_errors(result, spec)
        lengths = bounded(np.array([gap.length for gap in found.gaps]))
        for i, (name, errors) in enumerate(found.errors.items()):
            plain = name == PLAIN_ODOMETER
            colour = BLACK if plain else observer_line(spec.observers, name)["color"]
            marker = "x" if plain else MARKERS[i % len(MARKERS)]
            sizes = np.clip(np.abs(errors), SMALLEST, LARGEST)
            ax.plot(lengths, sizes, marker=marker, color=colour, label=found.labels[name], **_MARK_STYLE)
        # from zero on, so that balises at one distance are a column of marks on a scale that can be read
        way = np.linspace(0.0, max(1.05 * float(np.max(lengths, initial=0.0, where=np.isfinite(lengths))), 1.0), 50)
        ax.plot(way, np.clip(envelope(way), SMALLEST, LARGEST), color=MARK, linewidth=1.2, label=_GRANTED)
        ax.set_xlim(way[0], way[-1])
        logarithmic(ax)
        ax.set_xlabel("Way since the last balise [m]")
        ax.set_ylabel("|Position error| at the end [m]")

    @classmethod
    def available(cls, result: Result, spec: ReportSpec) -> bool:  # noqa: D102 - see Panel
        return bool(gap_errors(result, spec).errors)
