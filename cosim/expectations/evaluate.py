"""Judging a run by what its scenario expects of it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from cosim.expectations.evaluated import Evaluated, with_margin
from cosim.expectations.evaluated_run import EvaluatedRun, NotRecordedError
from plant_models.explained_error import explained

if TYPE_CHECKING:
    from cosim.run.outcome import Outcome
    from cosim.scenario.schema import ScenarioTable


def evaluate(table: ScenarioTable, outcome: Outcome) -> list[Evaluated]:
    """Hold a run against the expectations of its scenario.

    Args:
        table: the scenario. outcome: of its run; of a run that failed, what is not reached is not met.

    Returns:
        What became of each expectation, in order; one that limits several things gives several entries.
    """
    run = EvaluatedRun(outcome.result, outcome.spec, table.start, table.stop)
    return [evaluated for place, item in enumerate(table.expect, start=1) for evaluated in _evaluate(place, item, run)]


def _evaluate(place: int, item: Any, run: EvaluatedRun) -> list[Evaluated]:
    try:
        parts = item.evaluate(run)
    except NotRecordedError as error:
        parts = [Evaluated(item.check, item.check, passed=False, text=str(error))]
    except Exception as error:  # code of others
        parts = [Evaluated(item.check, item.check, passed=False, text=f"evaluate() failed: {explained(error)}")]
    if not isinstance(parts, list) or not all(isinstance(part, Evaluated) for part in parts):
        text = f"evaluate() returned {type(parts).__name__}; expected a list of Evaluated"
        parts = [Evaluated(item.check, item.check, passed=False, text=text)]
    if item.name is not None:
        parts = [replace(j, name=item.name if len(parts) == 1 else f"{item.name} ({j.name})") for j in parts]
    return [with_margin(replace(j, number=place)) for j in parts]
