"""The catalogue: all checks that run an FMU, in order, by interface type, and what it means where one fails.

What a failure means is judged by what becomes of a run of this package's master: NOTE, where no master of this package
does such a thing; LIMIT, where a run is right as long as the advice is followed; DISTRUST, where a plain run may be
wrong or may not come to its end. A crash is never less than a limit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from fmus.check.checks import derivatives, events, instances, life, model, state, steps
from fmus.check.context import Context
from fmus.check.findings import Finding, Outcome, Verdict
from fmus.fmi.standard import CO_SIMULATION, MODEL_EXCHANGE

NOTE, LIMIT, DISTRUST = Verdict.NOTE, Verdict.LIMIT, Verdict.DISTRUST


@dataclass(frozen=True)
class Check:
    """One check.

    Args:
        name: as it is reported.
        run: what it does; raises `fmus.check.instance.SlaveError` where the FMU refuses or throws, which is a failure.
        failing: what a failure means.
        advice: what to do then.
        basis: where it is distrusted, the FMU cannot be run at all and the rest is skipped.
        compares: compares two runs, which tells nothing where equal runs differ anyway.
    """

    name: str
    run: Callable[[Context], Outcome]
    failing: Verdict
    advice: str = ""
    basis: bool = False
    compares: bool = False

    def finding(self, outcome: Outcome) -> Finding:
        """The finding of an outcome."""
        verdict = outcome.verdict or self.failing
        advice = outcome.advice or self.advice
        return Finding(self.name, verdict, outcome.detail, advice if verdict.rank >= Verdict.ERROR.rank else "")

    def lost(self, detail: str, *, crashed: bool) -> Finding:
        """The finding where the process ended or fell silent in this check.

        Args:
            detail: how the process ended, in words.
            crashed: whether it ended by itself, and not by the time limit.
        """
        verdict = LIMIT if crashed and self.failing is NOTE else self.failing
        advice = f"{self.advice}; {NO_PROBE}" if crashed and self.advice else self.advice if crashed else SLOW
        return Finding(self.name, verdict, detail, advice)


REPEATED = "repeated run"
ONE_INSTANCE = "have one instance of it in a process, a fresh process for each run"
NO_PROBE = "with balises on it, choose the method early-return or interpolate: the probe for the others would crash too"
SLOW = "it hangs or is slow there: a longer --timeout tells which"
MISSING = "do not use the capabilities whose functions are missing"
NO_REDOING = "do not redo steps: the master finds crossings by shorter steps or interpolation, and iterates nothing"
FIXED_STEP = "keep to one communication step; an event inside it can only be interpolated"
NO_BYTES = "do not store its states or take them to another instance"

SLAVE_CHECKS = (
    Check("loading", life.loading, DISTRUST, basis=True),
    Check("exported symbols", life.slave_symbols, LIMIT, MISSING),
    Check("initialise", life.initialise, DISTRUST, "give start values, if it needs some", basis=True),
    Check(
        "values at start",
        life.values_at_start,
        LIMIT,
        "give start values, so that what it feeds does not begin with these",
    ),
    Check("getters", life.getters, LIMIT, "leave these variables out of connections and recordings"),
    Check("stepping", life.stepping, DISTRUST, basis=True),
    Check(REPEATED, life.repeated, LIMIT, "give each run a fresh process, and compare no two runs digit by digit"),
    Check("reset and re-run", life.reset, LIMIT, "make a new instance for each run", compares=True),
    Check("divided steps", steps.divided, LIMIT, FIXED_STEP, compares=True),
    Check("short step", steps.short, LIMIT, FIXED_STEP, compares=True),
    Check(
        "state round trip",
        state.round_trip,
        LIMIT,
        NO_REDOING,
        compares=True,
    ),
    Check("serialised state", state.serialised, LIMIT, NO_BYTES, compares=True),
    Check("state in another instance", state.other_instance, LIMIT, NO_BYTES, compares=True),
    Check("two instances", instances.two_instances, LIMIT, ONE_INSTANCE, compares=True),
    Check(
        "repeated instantiation", instances.repeated_instantiation, LIMIT, "do not make many instances in one process"
    ),
    Check("logging", life.logging, LIMIT, "leave its logging off", compares=True),
    Check("events", events.events, DISTRUST),
    Check("directional derivatives", derivatives.slave_derivatives, LIMIT, "do not use its derivatives"),
    Check("tiny step", steps.tiny, LIMIT, "use no step far below its communication step"),
    Check("huge step", steps.huge, NOTE, "use no step far above its communication step"),
    Check("zero step", steps.zero, NOTE, "never send a step of length zero, as some masters do"),
    Check("negative step", steps.negative, NOTE, "never send a negative step"),
    Check("step from elsewhere", steps.wrong_time, NOTE, "never step it from where it does not stand"),
    Check("time per step", life.time_per_step, NOTE),
)

MODEL_CHECKS = (
    Check("model exchange: loading", model.loading, DISTRUST, basis=True),
    Check("model exchange: exported symbols", model.model_symbols, LIMIT, MISSING),
    Check("model exchange: initialise", model.initialise, DISTRUST, "give start values, if it needs some", basis=True),
    Check("model exchange: values at start", model.finite_derivatives, DISTRUST, "give start values"),
    Check("model exchange: states", model.states, DISTRUST),
    Check("model exchange: reset and re-run", model.reset, LIMIT, "make a new instance for each run"),
    Check("model exchange: state round trip", model.round_trip, LIMIT, "do not rely on saved states"),
    Check("model exchange: directional derivatives", model.directional, LIMIT, "do not use its derivatives"),
)

CATALOGUE = {CO_SIMULATION: SLAVE_CHECKS, MODEL_EXCHANGE: MODEL_CHECKS}


def check_of(interface: str, name: str) -> Check:
    """A check by its name.

    Args:
        interface: interface type.
    """
    return next(check for check in CATALOGUE[interface] if check.name == name)
