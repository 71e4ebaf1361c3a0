"""Figures of normalised squares, of innovations and of errors, beside their chi-square bands."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from matplotlib.axes import Axes

from cosim.drawing.style import GAP, MARK, observer_line
from cosim.evaluation.consistency import FilterConsistency, Kind, filter_consistency
from cosim.evaluation.roles import label
from cosim.evaluation.spec import ReportSpec
from cosim.report.figures.drawing import curve, logarithmic, mark_evaluation
from cosim.report.figures.panel import Panel
from cosim.results.result import Result
from fmu_observer.formulas.filtering.covariance_consistency import chi_square_band

_AVERAGED = 50  # samples in the drawn mean, at most a quarter of all
SMALLEST, LARGEST = 1e-2, 1e3  # of a drawn share; beyond it is cut


def _chosen(result: Result, spec: ReportSpec, kinds: Sequence[Kind]) -> list[FilterConsistency]:
    """Of each observer the entries of the first of these kinds that it has."""
    found = filter_consistency(result, spec)
    chosen: list[FilterConsistency] = []
    for observer in spec.observers:
        of_it = [[e for e in found if e.observer == observer and e.kind == kind] for kind in kinds]
        chosen += next((entries for entries in of_it if entries), [])
    return chosen


class _ConsistencyPanel(Panel):
    """Normalised squares over their degrees of freedom on a logarithmic axis, moving means, and the band of these
    means.
    """

    kinds: ClassVar[tuple[Kind, ...]]

    @classmethod
    def plot(cls, result: Result, spec: ReportSpec, ax: Axes) -> None:
        entries = _chosen(result, spec, cls.kinds)
        shortest = min((len(e.squares) for e in entries), default=0)
        # errors of samples that follow each other are alike
        count = max(min(_AVERAGED, shortest // 4), 1) if cls.kinds == ("NIS",) else 1
        for degrees in sorted({float(e.degrees.mean()) for e in entries}):
            band = chi_square_band(degrees, float(count))
            text = f"95 % band, {degrees:g} degree{'s' if degrees != 1.0 else ''} of freedom"
            ax.axhspan(band.low / degrees, band.high / degrees, color=GAP, alpha=0.3, linewidth=0, label=text)
        ax.axhline(1.0, color=MARK, linewidth=0.8)
        names = [f"{e.observer} {e.name}" for e in entries]
        for name, entry in zip(names, entries, strict=True):
            mean = np.convolve(entry.squares / entry.degrees, np.full(count, 1.0 / count), mode="valid")
            degrees = float(entry.degrees.mean())
            band = chi_square_band(degrees, float(count))
            inside = np.mean((mean * degrees >= band.low) & (mean * degrees <= band.high))
            text = label(spec, entry.observer) + ("" if entry.kind != "error" else f", {entry.quantity}")
            text = f"{text}: {100.0 * inside:.3g} % inside"
            drawn = np.clip(mean, SMALLEST, LARGEST)
            curve(ax, entry.time[count - 1 :], drawn, None, label=text, **observer_line(names, name))
        logarithmic(ax)
        ax.set_ylabel(f"{cls.kinds[0]} / degrees of freedom [1]")
        mark_evaluation(ax, result, spec)

    @classmethod
    def available(cls, result: Result, spec: ReportSpec) -> bool:
        return bool(_chosen(result, spec, cls.kinds))


class NisPanel(_ConsistencyPanel):
    """NIS, and the band of the means of many samples."""

    name = "nis"
    title = "Normalised innovations (NIS)"
    caption = (
        "Moving mean of the squares of the innovations over what the filter expects; a consistent filter stays in the "
        "band for 95 % of the time. Above it the filter trusts itself too much, below it too little."
    )
    place = 3.7
    kinds = ("NIS",)


class NeesPanel(_ConsistencyPanel):
    """NEES of all states where the covariance was recorded, else of each quantity with its standard deviation, and the
    band of one sample.
    """

    name = "nees"
    title = "Normalised errors (NEES)"
    caption = "Squares of the errors over what the filter's covariance lets expect, and the band of 95 % of them."
    place = 3.8
    kinds = ("NEES", "error")
