"""Checks of what an instance takes: parameters and inputs read back, and calls that return a warning."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from time import perf_counter

from fmpy.model_description import ModelVariable

from fmus.check.check import LIMIT, NOTE, Check
from fmus.check.checked_instance import SlaveError
from fmus.check.checks.life_checks import SHARE_OF_BUDGET, by, listed
from fmus.check.context import Context
from fmus.check.findings import CheckOutcome, failed, noted, passed
from fmus.check.runner import SLOW_STEPS, elsewhere
from fmus.fmi.read_back import NotTaken, not_taken
from fmus.fmi.types import FLOATING_TYPES, NUMERIC_TYPES

_SHARES = (1.0, 0.25)
"""How far from its start value a parameter is set, as a share of it; less where the instance refuses more."""


def _other_value(variable: ModelVariable, share: float) -> float | None:
    """Another value than the declared start, in the declared range; None where there is none."""
    try:
        start = {"true": 1.0, "false": 0.0}.get(str(variable.start)) if variable.type == "Boolean" else None
        start = float(variable.start or 0.0) if start is None else start
        low, high = (float(bound) for bound in (variable.min or "-inf", variable.max or "inf"))
    except (TypeError, ValueError):  # an array, or nothing that is a number
        return None
    if variable.type == "Boolean":
        return 1.0 - start
    step = share * (abs(start) or 1.0) if variable.type in FLOATING_TYPES else 1.0
    return next((value for value in (start + step, start - step) if low <= value <= high), None)


def _begun(context: Context, starts: Mapping[str, float]) -> Iterator[NotTaken]:
    """The parameters among these and the stated start values that an instance does not have after its first step."""
    with context.fresh_runner(starts) as runner:
        runner.begin(excited=False)
        runner.steps_at_most(1)  # some forget it in a step
        variables = runner.component.variables
        kept = {n: v for n, v in runner.starts.items() if variables[n].causality == "parameter"}
        yield from not_taken(runner.component, kept)


def _parameters_not_taken(context: Context) -> list[NotTaken]:
    """All are set at once; where the instance refuses that, one after the other as long as there is time."""
    own = [v for v in context.description.modelVariables if v.causality == "parameter" and v.type != "Enumeration"]
    free = [v for v in own if v.name not in context.starts and v.alias is None and not v.shape and not v.clocks]
    numbers, chosen = [v for v in free if v.type in NUMERIC_TYPES], dict[str, float]()
    for share in _SHARES:
        chosen = {v.name: value for v in numbers if (value := _other_value(v, share)) is not None}
        with suppress(SlaveError):
            return list(_begun(context, chosen))
    found, since = list(_begun(context, {})), perf_counter()
    for name, value in chosen.items():
        if perf_counter() - since > SHARE_OF_BUDGET * context.budget:
            break
        with suppress(SlaveError):
            found += [one for one in _begun(context, {name: value}) if one.name == name]
    return found


class ValuesTakenCheck(Check, failing=LIMIT, advice="do not set these: it computes with what it has", place=6.2):
    """Parameters and inputs have, when they are read back, what they were set."""

    name = "values taken"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        found = _parameters_not_taken(context)
        runner = context.runner
        runner.begin()
        runner.set_inputs(elsewhere(runner.amplitude))
        stated = runner.inputs
        runner.step(runner.h)
        found += not_taken(runner.component, stated)
        if found:
            return failed(f"does not take what it is set: {listed([str(one) for one in found])}")
        return passed("parameters and inputs have what they were set")


class ContradictionsCheck(
    Check,
    failing=LIMIT,
    advice="do not rely on its own word: steps go to where they are asked to, and its events reach nobody",
    place=6.3,
):
    """Steps say nothing that the standard or the description forbids, under the start values of the inputs."""

    name = "word of steps"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        with context.begun_runner() as runner:
            runner.steps_at_most(min(SLOW_STEPS, context.steps))
            said = runner.component.contradictions
        return by(f"doStep says what it must not: {said}" if said else "", "steps say nothing that they must not")


class WarningsCheck(Check, failing=NOTE, place=6.4):
    """Calls that return the status warning, which is no failure, under the start values of the inputs."""

    name = "warnings"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        with context.begun_runner() as runner:
            steps = runner.steps_at_most(min(SLOW_STEPS, context.steps))
            warnings = runner.component.call_warnings
        if warnings:
            return noted(f"calls returned the status warning in a run of {steps} steps: {warnings}")
        return passed(f"no call returned the status warning in a run of {steps} steps")
