"""The catalogue: all checks that run an FMU, in order, by interface type. A list and nothing else."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from fmus.check import checks_derivatives, checks_events, checks_instances, checks_life, checks_model, checks_state, checks_steps
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
    Check("exported symbols", checks_life.slave_symbols),
    Check("initialise", checks_life.initialise, basis=True),
    Check("values at start", checks_life.values_at_start),
    Check("getters", checks_life.getters),
    Check("stepping", checks_life.stepping, basis=True),
    Check("reset and re-run", checks_life.reset),
    Check("divided steps", checks_steps.divided),
    Check("short step", checks_steps.short),
    Check("state round trip", checks_state.round_trip),
    Check("serialised state", checks_state.serialised),
    Check("state in another instance", checks_state.other_instance),
    Check("two instances", checks_instances.two_instances),
    Check("repeated instantiation", checks_instances.repeated_instantiation),
    Check("logging", checks_life.logging),
    Check("events", checks_events.events),
    Check("directional derivatives", checks_derivatives.slave_derivatives),
    Check("tiny step", checks_steps.tiny),
    Check("huge step", checks_steps.huge),
    Check("zero step", checks_steps.zero),
    Check("negative step", checks_steps.negative),
    Check("step from elsewhere", checks_steps.wrong_time),
    Check("time per step", checks_life.time_per_step),
)

MODEL_CHECKS = (
    Check("model exchange: exported symbols", checks_model.model_symbols),
    Check("model exchange: initialise", checks_model.initialise, basis=True),
    Check("model exchange: values at start", checks_model.finite_derivatives),
    Check("model exchange: states", checks_model.states),
    Check("model exchange: reset and re-run", checks_model.reset),
    Check("model exchange: state round trip", checks_model.round_trip),
    Check("model exchange: directional derivatives", checks_model.directional),
)

CATALOGUE = {CO_SIMULATION: SLAVE_CHECKS, MODEL_EXCHANGE: MODEL_CHECKS}
