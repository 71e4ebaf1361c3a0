"""Runs to be laid over each other: each with a label, judged alike. Imports NumPy only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from cosim.errors import ComparisonError
from cosim.evaluation.spec import Phase, ReportSpec
from cosim.results.result import Result
from plant_models.repeated_names import repeated_names

MOST_RUNS = 12  # that anybody can distinguish in a figure


@dataclass(frozen=True)
class OverlayRun:
    """A run among others.

    Args:
        label: text to show for it. result: the run. own_spec: its roles as they were.
        spec: the same with the phases, the zones and the start of the evaluation of the first run.
    """

    label: str
    result: Result
    spec: ReportSpec
    own_spec: ReportSpec


def make_runs(results: Sequence[Result], specs: Sequence[ReportSpec], labels: Sequence[str]) -> list[OverlayRun]:
    """Put results, roles and labels together; all are judged over the phases and zones of the first.

    Args:
        results: the runs, the first one is what the others are compared with. specs: roles of each. labels: text for
            each.

    Raises:
        ComparisonError: other numbers of results, roles and labels; a label twice; a run without rows; too many runs.
    """
    if not results or not len(results) == len(specs) == len(labels):
        counts = f"{len(results)} results, {len(specs)} roles and {len(labels)} labels"
        raise ComparisonError(f"Each run needs its roles and its label: got {counts}.")
    if len(results) > MOST_RUNS:
        raise ComparisonError(
            f"At most {MOST_RUNS} runs can be distinguished in a figure (got {len(results)}): choose some."
        )
    if twice := repeated_names(labels):
        raise ComparisonError(f"Two runs have the label {twice[0]!r}: give each its own, for instance with --labels.")
    for label, result in zip(labels, results, strict=True):
        if not len(result.time):
            raise ComparisonError(f"{label} has no rows: {result.failure or 'an empty table'}. Leave it out.")
    shared = _shared(results, specs[0])
    return [
        OverlayRun(label, result, _like(shared, spec), spec)
        for label, result, spec in zip(labels, results, specs, strict=True)
    ]


def _shared(results: Sequence[Result], spec: ReportSpec) -> ReportSpec:
    """The first run's roles, with one phase over all where it names none."""
    if spec.phases:
        return spec
    start, end = min(float(r.time[0]) for r in results), max(float(r.time[-1]) for r in results)
    return replace(spec, phases=[Phase("whole run", start, end)])


def _like(first: ReportSpec, spec: ReportSpec) -> ReportSpec:
    return replace(
        spec,
        phases=first.phases,
        zones=first.zones or spec.zones,
        evaluate_after=first.evaluate_after,
        published={},
        independent={},
    )


def observers_of(runs: Sequence[OverlayRun]) -> list[str]:
    """All observers, in the order in which the runs name them.

    Args:
        runs: from `make_runs`.
    """
    return list(dict.fromkeys(observer for run in runs for observer in run.spec.observers))


def one_each(runs: Sequence[OverlayRun]) -> bool:
    """Whether every run has a single observer: then these are compared, whatever their names.

    Args:
        runs: from `make_runs`.
    """
    return all(len(run.spec.observers) == 1 for run in runs)
