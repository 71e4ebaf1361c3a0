"""Checks of steps in co-simulation: divided ones, tiny ones, and sizes no master should ask for."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fmus.check.behaviour import divided_steps, short_step
from fmus.check.check import FIXED_STEP, LIMIT, NOTE, VARIABLE_STEP, Check
from fmus.check.checks.life_checks import by, listed, not_finite
from fmus.check.context import Context
from fmus.check.findings import CheckOutcome, failed, noted, passed
from fmus.fmi.slave import RawStep

SCALES = (1.0, 0.37, 3.0)
TINY = 1e-9
HUGE = 1000.0
_BEFORE = 3
"""Ordinary steps before an odd one."""


_Evaluate = Callable[[str, bool, str], CheckOutcome]


def _odd(
    context: Context,
    size: Callable[[float], float],
    evaluate: _Evaluate,
    shift: Callable[[float], float] = lambda _h: 0.0,
) -> CheckOutcome:
    """One odd step on an instance of its own after three ordinary ones; its outcome is evaluated."""
    with context.fresh_runner() as runner:
        runner.begin()
        before = runner.steps((runner.h,) * _BEFORE)[-1]
        slave = runner.component
        runner.set_inputs(runner.amplitude)
        said = slave.raw_step(runner.now + shift(runner.h), size(runner.h))
        if said.refused:
            return _refusal(said)
        after = runner.outputs()
        bad = not_finite(runner.output_names, after, slave.variables) if np.isfinite(before).all() else []
        moved = not np.array_equal(before, after, equal_nan=True)
        what = f"a step of {size(runner.h):g} s" + (f" from {shift(runner.h):g} s too late" if shift(runner.h) else "")
        return evaluate(what, moved, listed(bad))


def _refusal(said: RawStep) -> CheckOutcome:
    if said.status == "fatal":
        return noted("refused with status fatal: the instance is lost")
    return passed(f"refused with status {said.status}")


def _done_or_refused(what: str, moved: bool, bad: str) -> CheckOutcome:
    if bad:
        return failed(f"accepts {what} and is not finite after it: {bad}")
    return passed(f"accepts {what}, " + ("the outputs move" if moved else "the outputs stay"))


def _still_or_refused(what: str, moved: bool, bad: str) -> CheckOutcome:
    if bad or moved:
        return noted(f"accepts {what}, and the outputs move" + (f": {bad}" if bad else ""))
    return passed(f"accepts {what}, the outputs stay")


def _must_refuse(what: str, moved: bool, bad: str) -> CheckOutcome:
    effect = f"not finite: {bad}" if bad else "the outputs move" if moved else "the outputs stay"
    return noted(f"accepts {what} instead of refusing it; {effect}")


class DividedStepsCheck(Check, failing=LIMIT, advice=FIXED_STEP, compares=True, place=9, declares=VARIABLE_STEP):
    """A step of h against 2 x h/2 and an uneven split, for several h."""

    name = "divided steps"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        runner = context.runner
        for scale in SCALES:
            problem = divided_steps(runner, scale)
            if problem:
                return failed(problem)
        return passed(f"whole and divided steps agree, for h = {', '.join(f'{s * runner.h:g}' for s in SCALES)} s")


class ShortStepCheck(Check, failing=LIMIT, advice=FIXED_STEP, compares=True, place=10, declares=VARIABLE_STEP):
    """The first change after a short step."""

    name = "short step"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        return by(short_step(context.runner), "tiny steps after a short one move the outputs by their share")


class TinyStepCheck(
    Check, failing=LIMIT, advice="use no step far below its communication step", place=19, declares=VARIABLE_STEP
):
    """A step of a billionth of a second."""

    name = "tiny step"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        return _odd(context, lambda _h: TINY, _done_or_refused)


class HugeStepCheck(Check, failing=NOTE, advice="use no step far above its communication step", place=20):
    """A step a thousand times the communication step, or to the end of the experiment."""

    name = "huge step"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        left = context.runner.end - context.start_time - _BEFORE * context.step
        return _odd(context, lambda h: max(min(HUGE * h, left), h), _done_or_refused)


class ZeroStepCheck(Check, failing=NOTE, advice="never send a step of length zero, as some masters do", place=21):
    """A step of length zero, which the standard does not know."""

    name = "zero step"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        return _odd(context, lambda _h: 0.0, _still_or_refused)


class NegativeStepCheck(Check, failing=NOTE, advice="never send a negative step", place=22):
    """A step back in time, which the standard forbids."""

    name = "negative step"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        return _odd(context, lambda h: -h, _must_refuse)


class StepFromElsewhereCheck(Check, failing=NOTE, advice="never step it from where it does not stand", place=23):
    """A step from a currentCommunicationPoint where the FMU does not stand."""

    name = "step from elsewhere"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        return _odd(context, lambda h: h, _done_or_refused, lambda h: 0.5 * h)
