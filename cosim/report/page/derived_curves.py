"""Curves that follow from a run and are offered on its page: gaps between telegrams, errors at their end beside what is
allowed, squares of filters, errors beside stated bounds, residuals, other trains. Imports NumPy only.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cosim.evaluation.balise_gaps import gap_errors
from cosim.evaluation.consistency import filter_consistency
from cosim.evaluation.event_counts import accepted_stamps
from cosim.evaluation.roles import estimate, estimation_error, label, recorded
from cosim.evaluation.spec import ReportSpec
from cosim.report.live.live_page import PageCurve, PagePanel, PageRecording
from cosim.results.result import Result

BOUND = "error_bound"
"""Output of an observer that bounds the size of its speed error [m/s]."""
RATIO = "ratio_"
"""Begin of the name of an output that is a residual divided by its threshold [1]."""
_FEWEST = 2  # points of a curve

Derived = tuple[list[PageRecording], PagePanel]


def derived_curves(result: Result, spec: ReportSpec) -> list[Derived]:
    """What follows from a run, each with the panel that shows it; what has no curve is left out.

    Args:
        result: the run. spec: roles.
    """
    found = [_gap_errors(result, spec), _gaps(result), _bounds(result, spec), _consistency(result, spec)]
    found += [_residuals(result, spec), _other_trains(result, spec)]
    return [(recordings, panel) for recordings, panel in found if panel.curves]


def _of(title: str, recordings: list[PageRecording], *, log: bool = False) -> Derived:
    """Recordings that have enough points, and a panel of all their curves."""
    kept = [r for r in recordings if len(r.x) >= _FEWEST]
    names = list(dict.fromkeys(curve.name for recording in kept for curve in recording.curves))
    return kept, PagePanel(title, names, log=log, is_shown=False)


def _gap_errors(result: Result, spec: ReportSpec) -> Derived:
    """Position errors in the last row before each telegram is used, and what SUBSET-041 allows there."""
    gaps = gap_errors(result, spec)
    ends = np.array([gap.end for gap in gaps.gaps])
    allowed = np.array([gap.envelope for gap in gaps.gaps])
    curves = [
        PageCurve(f"SUBSET-041.{text}", sign * allowed, "m", look="allowed", label=f"SUBSET-041, {text}")
        for text, sign in (("least", -1.0), ("most", 1.0))
    ]
    for name, error in gaps.errors.items():
        text = gaps.labels[name]
        about = f"Estimated minus true position of {text} just before each telegram is used"
        curves.append(PageCurve(f"{name}.position error at balises", error, "m", description=about, label=text))
    order = np.argsort(ends, kind="stable")
    ordered = [PageCurve(c.name, c.values[order], c.unit, False, c.description, c.look, c.label) for c in curves]
    return _of("Position error at balises", [PageRecording("at balises", ends[order], ordered)] if gaps.errors else [])


def _gaps(result: Result) -> Derived:
    stamps = np.array(accepted_stamps(result.events))
    text = "Time since the telegram before that was used"
    gaps = PageCurve("telegrams.sampling gap", np.diff(stamps), "s", description=text, label="sampling gap")
    return _of("Sampling gaps", [PageRecording("telegrams", stamps[1:], [gaps])])


def _bounds(result: Result, spec: ReportSpec) -> Derived:
    """Size of the speed error over the bound that its observer states; above 1 the bound is broken."""
    curves = []
    for observer in spec.observers:
        bound, error = estimate(result, observer, BOUND), estimation_error(result, spec, observer, "speed")
        if bound is not None and error is not None:
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                share = np.where(error == 0.0, 0.0, np.abs(error) / bound)
            text = "Size of the speed error over its stated bound; above 1 the bound is broken"
            name = f"{observer}.speed error over its bound"
            curves.append(PageCurve(name, share, "1", description=text, label=label(spec, observer)))
    return _of("Speed error over its bound", [PageRecording("run", result.time, curves)] if curves else [], log=True)


def _consistency(result: Result, spec: ReportSpec) -> Derived:
    recordings = []
    for found in filter_consistency(result, spec):
        name, text = f"{found.observer}.{found.name} share", f"{label(spec, found.observer)}: {found.name}"
        about = f"{found.name} over its degrees of freedom: 1 in the mean of a consistent filter"
        with np.errstate(divide="ignore", invalid="ignore"):
            share = found.squares / found.degrees
        recordings.append(PageRecording(text, found.time, [PageCurve(name, share, "1", description=about, label=text)]))
    return _of("NIS and NEES", recordings, log=True)


def _residuals(result: Result, spec: ReportSpec) -> Derived:
    starts = tuple(f"{observer}.{RATIO}" for observer in spec.observers)
    names = [name for name in result.table.dtype.names or () if starts and name.startswith(starts)]
    return [], PagePanel("Residuals over their thresholds", names, log=True, is_shown=False)


def _other_trains(result: Result, spec: ReportSpec) -> Derived:
    """How far the other trains of the run are ahead of the one that is observed."""
    true = recorded(result, spec.true_position)
    curves = list(_ahead(result, spec, true)) if true is not None else []
    return _of("Other trains", [PageRecording("run", result.time, curves)] if curves else [])


def _ahead(result: Result, spec: ReportSpec, true: np.ndarray) -> Iterator[PageCurve]:
    for train in spec.other_trains:
        position = estimate(result, train, "position")
        if position is not None:
            text = "How far it is ahead of the train that is observed"
            name = f"{train}.ahead of the true train"
            yield PageCurve(name, position - true, "m", description=text, label=label(spec, train))
