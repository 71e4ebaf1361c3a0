"""Check a result against a baseline: refuse what has nothing to do with it, compare, and say what else was
different.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

from cosim.baselines.baseline import Baseline
from cosim.baselines.causes import Pair, causes, equal_models
from cosim.baselines.draft import resolve, resolved, versions_of
from cosim.baselines.model_identity import identities
from cosim.comparison.compare import compare_results, run_differences
from cosim.comparison.comparison import Comparison
from cosim.comparison.tolerance import Tolerances
from cosim.errors import BaselineError, ComparisonError
from cosim.results.result import Result
from cosim.run.outcome import Outcome
from fmus.tables.plain_data import jsonable

MODELS = ("FMU", "block")
"""Components that are models; a recording that is played back is not."""
NOTHING_ELSE = "What was run is as the baseline states it: models, parameters, times and versions."


@dataclass(frozen=True)
class Regression(Comparison):
    """A comparison with a baseline.

    Args:
        outcome: of the run; None where only a result was given. actual: the result.
        baseline: None where there is none yet (while baselines are written).
    """

    outcome: Outcome | None = None
    actual: Result | None = None
    baseline: Baseline | None = None


def check(
    result: Result | Outcome, baseline: Baseline, tolerances: Tolerances | None = None, *, label: str = "result"
) -> Regression:
    """Compare a result with a baseline.

    Args:
        result: of a run, or its outcome. baseline: what it should be like.
        tolerances: those of the baseline where none are given. label: what the result is called.

    Raises:
        BaselineError: the baseline is of another model.
        ComparisonError: the run is empty, or has no signal of the baseline.
    """
    outcome = result if isinstance(result, Outcome) else None
    actual = result if isinstance(result, Result) else result.result
    pairs = equal_models(baseline.header.components, identities(actual))
    _demand_equal_models(pairs, baseline)
    if not len(actual.table):
        raise ComparisonError(f"The run is empty: it has no rows to compare with {baseline.label}.")
    names = [info.name for info in (*baseline.result.signals, *actual.signals)]
    shown = _as_in_header(_selected(actual, baseline))
    allowed = resolved(tolerances or baseline.tolerances, names)
    comparison = compare_results(baseline.result, shown, allowed, labels=(baseline.label, label))
    found = causes(pairs, run_differences(baseline.result, shown))
    if not found and pairs and not comparison.equal:
        found = [NOTHING_ELSE]
    notes = dict.fromkeys([*baseline.notes, *found, *comparison.notes])
    return regression(replace(comparison, causes=found, notes=tuple(notes)), outcome, actual, baseline)


def regression(
    comparison: Comparison, outcome: Outcome | None, actual: Result, baseline: Baseline | None
) -> Regression:
    """A comparison with the run behind it.

    Args:
        comparison: what was found.
        outcome: the run; None for a result of an earlier one.
        actual: what was compared with the baseline.
        baseline: what it was held against; None where it was made now.
    """
    stated: dict[str, Any] = {entry.name: getattr(comparison, entry.name) for entry in fields(Comparison)}
    return Regression(**stated, outcome=outcome, actual=actual, baseline=baseline)


def _demand_equal_models(pairs: Sequence[Pair], baseline: Baseline) -> None:
    """Refuse a result of another model; the same model with another GUID is a new delivery.

    Raises:
        BaselineError: a component is of another model; says both.
    """
    for before, now in pairs:
        if before.kind in MODELS and now.kind in MODELS and before.model and now.model and before.model != now.model:
            raise BaselineError(
                f"{baseline.label} is a baseline of another FMU: {before.name} was the model '{before.model}' "
                f"(GUID {before.guid}), the run used the model '{now.model}' (GUID {now.guid}). "
                "Run the model of the baseline, or make a new baseline."
            )


def _selected(result: Result, baseline: Baseline) -> Result:
    """The result without the signals that the baseline was not to keep, so that they are not called extra."""
    if baseline.header.selection is None:
        return result
    kept = {info.name for info in baseline.result.signals}
    names = [info.name for info in result.signals]
    patterns = [resolve(pattern, names) for pattern in baseline.header.selection]
    fitting = Tolerances(ignore=tuple(patterns))
    shown = [info for info in result.signals if info.name in kept or fitting.ignores(info.name)]
    if not shown:  # so that the comparison can name what is near
        return result
    return replace(result, table=result.table[["time", *(info.name for info in shown)]], signals=shown)


def _as_in_header(result: Result) -> Result:
    """The result with a summary as a header would state it, so that the comparison's notes name what really differs."""
    if "components" not in result.summary:
        return result
    summary = {**result.summary, "components": jsonable(result.summary["components"]), "versions": versions_of(result)}
    return replace(result, summary=summary)
