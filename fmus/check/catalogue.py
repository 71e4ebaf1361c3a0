"""The catalogue: all checks that run an FMU, in order, by interface type. A list and nothing else."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from fmus.check.checks import derivatives, events, instances, life, model, state, steps
from fmus.check.context import Context
from fmus.check.findings import Outcome
from fmus.check.library import CO_SIMULATION, MODEL_EXCHANGE


@dataclass(frozen=True)
class Check:
    """One check.

    Args:
        name: as it is reported.
        run: what it does; may raise one of `fmus.check.steppable.FAILURES`, which is a failed check.
        basis: where it does not pass, the FMU cannot be run at all and the rest is skipped.
    """

    name: str
    run: Callable[[Context], Outcome]
    basis: bool = False


SLAVE_CHECKS = (
    Check("exported symbols", life.slave_symbols),
    Check("initialise", life.initialise, basis=True),
    Check("values at start", life.values_at_start),
    Check("getters", life.getters),
    Check("stepping", life.stepping, basis=True),
    Check("reset and re-run", life.reset),
    Check("divided steps", steps.divided),
    Check("short step", steps.short),
    Check("state round trip", state.round_trip),
    Check("serialised state", state.serialised),
    Check("state in another instance", state.other_instance),
    Check("two instances", instances.two_instances),
    Check("repeated instantiation", instances.repeated_instantiation),
    Check("logging", life.logging),
    Check("events", events.events),
    Check("directional derivatives", derivatives.slave_derivatives),
    Check("tiny step", steps.tiny),
    Check("huge step", steps.huge),
    Check("zero step", steps.zero),
    Check("negative step", steps.negative),
    Check("step from elsewhere", steps.wrong_time),
    Check("time per step", life.time_per_step),
)

MODEL_CHECKS = (
    Check("model exchange: exported symbols", model.model_symbols),
    Check("model exchange: initialise", model.initialise, basis=True),
    Check("model exchange: values at start", model.finite_derivatives),
    Check("model exchange: states", model.states),
    Check("model exchange: reset and re-run", model.reset),
    Check("model exchange: state round trip", model.round_trip),
    Check("model exchange: directional derivatives", model.directional),
)

CATALOGUE = {CO_SIMULATION: SLAVE_CHECKS, MODEL_EXCHANGE: MODEL_CHECKS}
