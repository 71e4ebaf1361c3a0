"""Initialisation: all components exchange inputs and outputs in Initialization Mode until nothing changes."""

from __future__ import annotations

import numpy as np

from cosim.coupling.plan import Plan
from cosim.errors import RunError

MAX_ROUNDS = 100
TOLERANCE = 1e-12
"""A value that moves by less than this share of itself has settled: a few roundings of a double."""


def initialise(plan: Plan, start_time: float, stop_time: float) -> int:
    """Bring all components from instantiated to step mode.

    What jumps when initialisation ends (a sample taken at the start time) is passed on once more, so that the first row is
    consistent.

    Args:
        plan: prepared, components instantiated and start values set.
        start_time, stop_time: [s].

    Returns:
        Number of exchange rounds it took.

    Raises:
        RunError: a component failed, or the exchange does not settle; the signals that still change are named.
    """
    for step in plan.steps:
        step.component.enter_initialization(start_time, stop_time)
    rounds = _settle(plan, start_time)
    for step in plan.steps:
        step.write()
        step.component.exit_initialization()
        step.read()
    _exchange(plan)
    return rounds


def _settle(plan: Plan, start_time: float) -> int:
    changed = np.ones(len(plan.values), dtype=bool)
    for round_number in range(1, MAX_ROUNDS + 1):
        previous = plan.values.copy()
        _exchange(plan)
        changed = ~np.isclose(plan.values, previous, rtol=TOLERANCE, atol=0.0, equal_nan=True)
        if not changed.any() and round_number > 1:
            return round_number
    names = [plan.signals[i].name for i in np.flatnonzero(changed)]
    shown = ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "")
    reason = f"Initialisation at t = {start_time:g} s does not settle after {MAX_ROUNDS} exchanges; still changing: {shown}."
    raise RunError(reason, names[0].partition(".")[0], start_time)


def _exchange(plan: Plan) -> None:
    for step in plan.steps:
        step.write()
        step.read()
