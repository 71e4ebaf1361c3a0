"""Judging a run by what its scenario expects of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from cosim.expectations.indicators import judge_off, judge_on
from cosim.expectations.judged import Judged
from cosim.expectations.run import NotRecordedError, Run
from cosim.expectations.telegrams import judge_telegrams
from cosim.expectations.values import ERRORS, judge_difference, judge_error, judge_signal
from cosim.expectations.whole_run import judge_certificate, judge_warnings

if TYPE_CHECKING:
    from cosim.scenario.outcome import Outcome
    from cosim.scenario.schema import ScenarioTable

JUDGES: dict[str, Callable[[Any, Run], list[Judged]]] = {
    **dict.fromkeys(ERRORS, judge_error),
    "difference": judge_difference,
    "signal": judge_signal,
    "on": judge_on,
    "off": judge_off,
    "telegrams": judge_telegrams,
    "certificate": judge_certificate,
    "warnings": judge_warnings,
}


def judge(table: ScenarioTable, outcome: Outcome) -> list[Judged]:
    """Hold a run against the expectations of its scenario.

    Args:
        table: the scenario. outcome: of its run; of a run that failed, what is not reached is not met.

    Returns:
        What became of each expectation, in order; one that limits several things gives several entries.
    """
    run = Run(outcome.result, outcome.spec, table.start, table.stop)
    return [judged for place, item in enumerate(table.expect, start=1) for judged in _judge(place, item, run)]


def _judge(place: int, item: Any, run: Run) -> list[Judged]:
    try:
        parts = JUDGES[item.check](item, run)
    except NotRecordedError as error:
        parts = [Judged(item.check, item.check, passed=False, text=str(error))]
    if item.name is not None:
        parts = [replace(j, name=item.name if len(parts) == 1 else f"{item.name} ({j.name})") for j in parts]
    return [replace(j, number=place) for j in parts]
