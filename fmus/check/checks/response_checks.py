"""Checks of when an FMU responds: to its first step, to an input, to being read early, and to declared start values."""

from __future__ import annotations

import numpy as np

from fmus.check.check import DISTRUST, LIMIT, Check
from fmus.check.checked_instance import SlaveError
from fmus.check.checks.life_checks import by, listed
from fmus.check.context import Context
from fmus.check.findings import CheckOutcome, failed, passed, skipped
from fmus.check.runner import WARM_UP_STEPS, Runner, elsewhere
from fmus.fmi.read_back import not_taken
from fmus.fmi.types import is_continuous

_STEPS = 4
_EVEN = 0.2
"""Share by which changes may differ from step to step and still be even: then the step before had one too."""


def _one_step_late(changes: np.ndarray) -> np.ndarray:
    """Which columns do not change in the first step and evenly from the second one on, shape (q,).

    What grows from nothing (a position whose speed has just begun to change) changes unevenly at first, and what is
    sampled does not change in each step.

    Args:
        changes: of each step, shape (steps, q).
    """
    first, second = np.abs(changes[0]), np.abs(changes[1])
    even = np.all(np.abs(changes[2:] - changes[1]) <= _EVEN * second, axis=0)
    late: np.ndarray = (first == 0.0) & (second > 0.0) & even
    return late


def _continuous(runner: Runner) -> np.ndarray:
    variables = runner.component.variables
    return np.array([is_continuous(variables[name]) for name in runner.output_names], dtype=bool)


def _named(runner: Runner, late: np.ndarray) -> str:
    return listed([name for name, is_late in zip(runner.output_names, late, strict=True) if is_late])


class FirstStepCheck(
    Check, failing=LIMIT, advice="begin the run a step earlier, and disregard that step", compares=True, place=8.2
):
    """The first step does as much as those that follow."""

    name = "first step"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        runner = context.runner
        rows = np.array([runner.begin(), *runner.steps((runner.h,) * _STEPS)])
        changes = np.diff(rows, axis=0)
        late = _one_step_late(changes) & _continuous(runner)
        if late.any() and np.array_equal(late, np.any(changes != 0.0, axis=0) & _continuous(runner)):
            return failed(f"the first step moves nothing, the second as much as the third: {_named(runner, late)}")
        return passed("the first step moves what the second one does")


class InputAtOnceCheck(
    Check, failing=LIMIT, advice="keep steps short: an input acts a step later", compares=True, place=8.4
):
    """What is set before a step acts in that step."""

    name = "input at once"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        runner = context.runner
        try:
            late = _late_after(runner, WARM_UP_STEPS) & _late_after(runner, WARM_UP_STEPS + 1)
        except SlaveError as error:
            runner.reset_works = False
            return skipped(f"other inputs break it: {error}")
        if late.any():
            return failed(f"an input that is set before a step acts in the one after it, on {_named(runner, late)}")
        return passed("no output follows an input one step late")


def _late_after(runner: Runner, steps: int) -> np.ndarray:
    """The continuous outputs that a change of the inputs after so many steps moves one step late, shape (q,)."""
    runs = []
    for amplitude in (runner.amplitude, elsewhere(runner.amplitude)):
        runner.begin()
        runner.steps((runner.h,) * steps)
        before = runner.outputs()
        runner.set_inputs(amplitude)
        runs.append(np.array([before, *runner.steps((runner.h,) * _STEPS)]))
    effect = runs[1] - runs[0]
    rises, steady = _one_step_late(np.diff(effect, axis=0)), _one_step_late(effect[1:])
    moved: np.ndarray = np.any(effect != 0.0, axis=0) & (rises | steady) & _continuous(runner)
    return moved


class DeclaredStartsCheck(
    Check, failing=LIMIT, advice="do not take the start values of its description for what it begins with", place=4.5
):
    """Outputs with an exact start value have it in Initialization Mode, or after it at the latest."""

    name = "declared start values"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        stated, wrong = _declared(context), set[str]()
        with context.quiet_runner() as runner:
            component = runner.component
            runner.begin(excited=False, meanwhile=lambda: wrong.update(n.name for n in not_taken(component, stated)))
            found = [one for one in not_taken(component, stated) if one.name in wrong]
        texts = [f"{n.name} begins with {n.has:.6g}, not with {n.stated:.6g} as it is declared" for n in found]
        return by(listed(texts), f"{len(stated)} outputs begin with what is declared")


class EarlyReadingCheck(Check, failing=DISTRUST, place=4.4):
    """Outputs can be read in Initialization Mode, as each run does to bring outputs and inputs into agreement."""

    name = "reading at initialisation"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        refused: list[str] = []
        with context.quiet_runner() as runner:
            slave = runner.component

            def read() -> None:
                try:
                    slave.read(slave.names("output"))
                except SlaveError as error:
                    refused.append(str(error))

            try:
                runner.begin(excited=False, meanwhile=read)
            except SlaveError:
                if not refused:  # else it follows from that
                    raise
        problem = f"outputs cannot be read in Initialization Mode: {refused[0]}" if refused else ""
        return by(problem, "outputs can be read in Initialization Mode")


def _declared(context: Context) -> dict[str, float]:
    """Exact start values of the continuous scalar outputs, by name."""
    own = (v for v in context.description.modelVariables if v.causality == "output" and v.initial == "exact")
    scalars = [v for v in own if is_continuous(v) and not v.shape and v.start is not None]
    return {v.name: float(v.start) for v in scalars if v.name not in context.starts}
