"""The check of a long run: to the end of the default experiment under the start values, as far as there is time."""

from __future__ import annotations

from time import perf_counter

from fmus.check.check import LIMIT, Check
from fmus.check.checked_instance import SlaveError
from fmus.check.checks.life_checks import listed, not_finite
from fmus.check.context import Context
from fmus.check.findings import CheckOutcome, failed, noted, passed
from fmus.check.runner import END, Runner

_SHARE_OF_BUDGET = 0.1
_USUAL = 10.0
"""How far to go where there is no default experiment [s]."""


class LongRunCheck(
    Check, failing=LIMIT, advice="end runs before that, or give it start values that it stands longer", place=6.6
):
    """Steps under the start values of the inputs to the end of the default experiment: no error, all finite."""

    name = "long run"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        with context.begun_runner() as runner:
            end = runner.end if runner.end < context.start_time + END else context.start_time + _USUAL
            try:
                bad = _stepped(runner, end, _SHARE_OF_BUDGET * context.budget)
            except SlaveError as error:
                return failed(f"a step from t = {runner.now:.6g} s fails: {error}")
            if bad:
                return failed(f"not finite from t = {runner.now:.6g} s on: {bad}")
            if runner.component.terminated:
                return noted(f"it asks for the end at t = {runner.now:.6g} s")
            short = "" if runner.now > end - runner.h else f"; to {end:.6g} s it takes longer than there is time here"
            return passed(f"to t = {runner.now:.6g} s, inputs at their start values{short}")


def _stepped(runner: Runner, end: float, seconds: float) -> str:
    """Step to `end` [s] for as long as there are `seconds`; which outputs are not finite where the instance stands."""
    since, names, variables = perf_counter(), runner.output_names, runner.component.variables
    while runner.now < end - 0.5 * runner.h and perf_counter() - since < seconds:
        for row in runner.step(runner.h):
            if bad := not_finite(names, row, variables):
                return listed(bad)
        if runner.component.terminated:
            break
    return ""
