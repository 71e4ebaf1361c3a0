"""Checks of an instance's life in co-simulation: symbols, start, values, steps, resets, logging, speed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from statistics import median
from time import perf_counter

import numpy as np
from fmpy.model_description import ModelVariable

from fmu_observer.annotated_variable import can_be_missing
from fmus.check.behaviour import difference, repeatable
from fmus.check.check import DISTRUST, LIMIT, MISSING, NOTE, Check
from fmus.check.checked_instance import SlaveError
from fmus.check.context import Context
from fmus.check.findings import CheckOutcome, Verdict, failed, limited, noted, passed
from fmus.check.runner import END, SLOW_STEPS, WARM_UP_STEPS, Runner
from fmus.fmi.instance import Instance
from fmus.fmi.library import functions_of_capabilities
from fmus.fmi.types import FLOATING_TYPES

SHARE_OF_BUDGET = 0.4
_TIMED_STEPS = 200
UNSEEN = "what it does when it moves was not seen: give start values (--start) or a longer step (--step)"
NAMES_SHOWN = 4


def _unreadable(slave: Instance, variable: ModelVariable) -> str:
    try:
        slave.get(variable)
    except SlaveError as error:
        return str(error)
    return ""


def _run(context: Context) -> CheckOutcome:
    runner = context.runner
    runner.begin()
    rows: list[np.ndarray] = []
    since = perf_counter()
    while len(rows) < context.steps and perf_counter() - since < SHARE_OF_BUDGET * context.budget:
        row = runner.step(runner.h)
        if not row:
            break
        rows += row
    if not rows:
        raise runner.component.failure("asks for the end in its first step")
    bad = not_finite(runner.output_names, np.sum(rows, axis=0), runner.component.variables)
    if bad:
        raise SlaveError(f"not finite while stepping: {listed(bad)}")
    done = f"{len(rows)} steps of {runner.h:g} s"
    if runner.component.terminated:
        return limited(f"{done}, then it asks for the end", f"end runs at {runner.now:g} s, where it ends by itself")
    if not runner.output_names:
        return limited(f"{done}; it has no number that moves and can be read", UNSEEN)
    if not runner.excited:
        return _unmoved(context, done)
    late = f"; {context.steps} were asked for, use a longer --timeout" if len(rows) < context.steps else ""
    above = (
        f"inputs {runner.amplitude:g} above their start values" if runner.amplitude else "inputs at their start values"
    )
    return passed(f"{done}, {above}{late}")


def _unmoved(context: Context, done: str) -> CheckOutcome:
    """Nothing moved so far. Without inputs, what stays so to the end of the experiment is all that a run meets."""
    driven = any(variable.causality == "input" for variable in context.description.modelVariables)
    with suppress(SlaveError):  # which the long run reports
        if not driven and context.runner.end < context.start_time + END and _still(context):
            return noted(f"{done}; it has no inputs, and nothing moves to the end of its experiment")
    return limited(f"{done}; nothing moved in the first {SLOW_STEPS}, what follows is weak", UNSEEN)


def _still(context: Context) -> bool:
    """Whether nothing moves to the end of the experiment; not, where that takes longer than there is time."""
    runner, since = context.runner, perf_counter()
    before = runner.begin()
    while runner.now < runner.end - 0.5 * runner.h:
        row = runner.step(runner.h)
        if not row or not np.array_equal(row[0], before, equal_nan=True):
            return False
        if perf_counter() - since > SHARE_OF_BUDGET * context.budget:
            return False
    return True


# -- helpers ----------------------------------------------------------------------------------------------------------


def by(problem: str, good: str) -> CheckOutcome:
    """Failed with the problem where there is one, else passed.

    Args:
        good: what to say where there is no problem.
    """
    return failed(problem) if problem else passed(good)


def compared(runner: Runner, runs: Sequence[Sequence[np.ndarray]], when: str, good: str) -> CheckOutcome:
    """Whether two runs gave the identical outputs.

    Args:
        runner: the instance under test. runs: outputs after each step, each of shape (q,), of both.
        when: they differ, in words. good: what to say where they do not.
    """
    problem = difference(runner, *runs)
    return by(problem and f"{when} {problem}", good)


def not_finite(
    names: Sequence[str], values: np.ndarray, variables: Mapping[str, ModelVariable] | None = None
) -> list[str]:
    """The names whose values are NaN or infinite, with the values; without those for which NaN is a value.

    Args:
        names: of the values. values: shape (len(names),). variables: by name; None where all must be numbers.
    """

    def wrong(name: str, value: float) -> bool:
        missing = variables is not None and math.isnan(value) and can_be_missing(variables[name])
        return not math.isfinite(value) and not missing

    return [f"{n} = {float(v):g}" for n, v in zip(names, values, strict=True) if wrong(n, v)]


def listed(names: Sequence[str]) -> str:
    """The first few, and how many more.

    Args:
        names: what is listed.
    """
    more = f" and {len(names) - NAMES_SHOWN} more" if len(names) > NAMES_SHOWN else ""
    return ", ".join(names[:NAMES_SHOWN]) + more


def real_names(instance: Instance, causality: str) -> list[str]:
    """Names of its scalar continuous real variables of one causality.

    Args:
        instance: whose variables they are.
    """
    found = (instance.variables[n] for n in instance.names(causality))
    return [v.name for v in found if v.type in FLOATING_TYPES and v.variability in (None, "continuous")]


class LoadingCheck(Check, failing=DISTRUST, basis=True, place=1):
    """The library can be loaded here, with all that it needs."""

    name = "loading"

    @classmethod
    def run(cls, context: Context) -> CheckOutcome:
        context.instance(cls.interface).free()
        return passed("the library and what it needs are loaded")


class ExportedSymbolsCheck(Check, failing=LIMIT, advice=MISSING, place=2):
    """The functions of the standard that the library exports, against what the FMU declares."""

    name = "exported symbols"

    @classmethod
    def run(cls, context: Context) -> CheckOutcome:
        instance = context.instance(cls.interface)
        try:
            missing = {name.lower(): name for name in instance.missing_functions}
        finally:
            instance.free()
        if not missing:
            return passed("the library exports every function of the interface")
        needed: dict[str, str] = {}
        for capability, function in functions_of_capabilities(instance.description, instance.interface):
            needed.setdefault(missing.pop(function, ""), capability)
        needed.pop("", None)
        if needed:
            lies = "; ".join(f"declares {capability} but does not export {name}" for name, capability in needed.items())
            return failed(lies)
        return noted(f"does not export {listed(sorted(missing.values()))}; some masters refuse such a library")


class InitialiseCheck(Check, failing=DISTRUST, advice="give start values, if it needs some", basis=True, place=3):
    """Instantiate, initialise."""

    name = "initialise"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        with context.begun_runner():
            pass
        return passed("instantiates and initialises")


class EndCheck(Check, failing=NOTE, place=3.5):
    """Terminate and free after some steps; where the process dies or hangs in one of these calls, it is a limit."""

    name = "terminate and free"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        with context.begun_runner() as runner:
            with suppress(SlaveError):  # which another check reports
                runner.steps((runner.h,) * WARM_UP_STEPS)
            component = runner.component
        failed_ends = component.failed_ends
        return by("; ".join(failed_ends), "terminates after some steps, and is freed")


class ValuesAtStartCheck(
    Check, failing=LIMIT, advice="give start values, so that what it feeds does not begin with these", place=4
):
    """NaN or infinite outputs and local variables after initialisation, under the start values of the inputs."""

    name = "values at start"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        with context.begun_runner() as runner:
            slave = runner.component
            outputs, locals_ = slave.names("output"), slave.names("local")
            bad_outputs = not_finite(outputs, slave.read(outputs), slave.variables)
            bad_locals = not_finite(locals_, slave.read(locals_))
        if bad_outputs:
            return failed(f"not finite after initialisation: {listed(bad_outputs)}")
        if bad_locals:
            return noted(f"not finite after initialisation: the local variables {listed(bad_locals)}")
        return passed(f"{len(outputs)} outputs and {len(locals_)} local variables are finite")


class GettersCheck(Check, failing=LIMIT, advice="leave these variables out of connections and recordings", place=5):
    """Every variable can be read by the getter of its type."""

    name = "getters"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        with context.begun_runner() as runner:
            slave = runner.component
            own = [v for v in slave.description.modelVariables if v.alias is None]
            readable = [v for v in own if v.type != "Clock" and not v.clocks]
            problems = list(filter(None, (_unreadable(slave, variable) for variable in readable)))
        left_out = len(own) - len(readable)
        note = f"; {left_out} clocks and clocked variables not tried" if left_out else ""
        if problems:
            return failed(f"{len(problems)} of {len(readable)} variables cannot be read: {problems[0]}{note}")
        return passed(f"{len(readable)} variables are read{note}")


class SteppingCheck(Check, failing=DISTRUST, basis=True, place=6):
    """A run of steps without an error, all outputs finite; where the inputs that excite it break it, under its start
    values.
    """

    name = "stepping"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        runner = context.runner
        try:
            return _run(context)
        except SlaveError as error:
            if not runner.amplitude:
                raise
            broken, runner.amplitude, runner.spread, runner.excited = str(error), 0.0, 0.0, False
        outcome = _run(context)
        if outcome.verdict is Verdict.DISTRUST:
            return outcome
        return limited(
            f"{outcome.detail}; under other inputs: {broken}", "keep its inputs in the range that it was made for"
        )


class RepeatedRunCheck(
    Check, failing=LIMIT, advice="give each run a fresh process, and compare no two runs digit by digit", place=7
):
    """Two instances, one after the other, under the same inputs: identical outputs."""

    name = "repeated run"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        runner = context.runner
        pattern = (runner.h,) * (2 * WARM_UP_STEPS)
        runner.begin()
        first = runner.steps(pattern)
        runner.begin()
        return compared(runner, (first, runner.steps(pattern)), "in a second run", "a second run is identical")


class ResetAndReRunCheck(Check, failing=LIMIT, advice="make a new instance for each run", compares=True, place=8):
    """After a reset the same steps give the identical outputs."""

    name = "reset and re-run"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        return by(repeatable(context.runner), "the same run after a reset is identical")


class LoggingCheck(Check, failing=LIMIT, advice="leave its logging off", compares=True, place=16, several=True):
    """The outputs must not depend on whether the FMU is asked to log."""

    name = "logging"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        runner = context.runner
        runner.begin()
        quiet = runner.steps((runner.h,) * WARM_UP_STEPS)
        with runner.twin(lambda: context.slave(logging=True)) as talking:
            talking.begin()
            loud = talking.steps((runner.h,) * WARM_UP_STEPS)
        return compared(runner, (quiet, loud), "with logging on", "logging changes no output")


class TimePerStepCheck(Check, failing=NOTE, place=24):
    """Median time of one step."""

    name = "time per step"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        runner = context.runner
        runner.begin()
        seconds: list[float] = []
        advance, since = runner.component.advance, perf_counter()
        most = min(_TIMED_STEPS, max(context.steps, 1))
        while (
            len(seconds) < most
            and not runner.component.terminated
            and perf_counter() - since < SHARE_OF_BUDGET * context.budget
        ):
            t = runner.t0 + len(seconds) * runner.h
            begin = perf_counter()
            advance(t, t + runner.h)
            seconds.append(perf_counter() - begin)
        middle = f"median {median(seconds) * 1e6:.3g} microseconds"
        return passed(f"{middle} for a step of {runner.h:g} s, the call from Python included")
