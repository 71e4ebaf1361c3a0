"""Restoring: what follows a restored state, against what followed when it was saved.

The state of a solver with a variable step is rarely all that a saved state holds: order, step size and history are
chosen anew, and what follows lies within the solver's tolerance of what it was. That is another finding than a state
that was not restored.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from fmus.check.behaviour import again, continuation, difference, go_elsewhere
from fmus.check.runner import WARM_UP_STEPS, Runner
from fmus.fmi.instance import FAILURES

Restores = Literal["exact", "within_tolerance", "no"]
_Trip = tuple[list[np.ndarray], np.ndarray]

USUAL_TOLERANCE = 1e-4
"""Relative tolerance of a solver that says nothing of its own: what most tools export with."""

SOLVER_FACTOR = 10.0
"""Restarts and the steps that are compared may each err by the tolerance."""

_REMAINDER = 0.1
"""A restored state must undo at least all but this share of what the excursion had changed, whatever the tolerance."""

FAR = 1e3
"""How much larger the inputs of the further excursion are."""

ROUNDING = 1e-12
"""Differences below this, relative to sizes above 1, are rounding."""


@dataclass(frozen=True)
class Restoring:
    """What a restored state was worth.

    Args:
        restores: ``exact`` bit for bit; ``within_tolerance`` of the solver; ``no``.
        mismatch: largest difference of an output after restoring, relative to its size, or its movement where that is
            more.
        apart: largest difference of each output in its own unit, shape (q,).
        problem: what differed, in words; empty where nothing did.
    """

    restores: Restores
    mismatch: float
    apart: np.ndarray
    problem: str = ""


def restoring(runner: Runner) -> Restoring:
    """Save, go on, go elsewhere under other inputs, restore twice: the same steps must give the same outputs.

    Several steps are compared, because a part of the state that was not restored may take time to show, and one of them
    is short where the FMU takes such steps. Where they differ, the instance is sent further away once more: what was
    not restored then differs by more, what a solver makes of its restart does not.

    Args:
        runner: the instance under test.
    """
    path = continuation(runner)
    runner.begin()
    runner.steps((runner.h,) * WARM_UP_STEPS)
    component = runner.component
    state, saved_at = component.save(), runner.now
    try:
        first = runner.steps(path)
        trips = [_trip(runner, state, saved_at, path) for _ in range(2)]
        problem = difference(runner, first, trips[0][0]) or difference(runner, first, trips[1][0])
        if not problem:
            return Restoring("exact", 0.0, np.zeros(len(first[0])))
        with suppress(*FAILURES):  # inputs that the FMU cannot stand say nothing of its states
            trips.append(_trip(runner, state, saved_at, path, FAR))
    finally:
        component.release(state)
    return _evaluated(np.array(first), trips, solver_tolerance(runner), f"after a restored state {problem}")


def _trip(runner: Runner, state: Any, saved_at: float, path: Sequence[float], distance: float = 1.0) -> _Trip:
    """The outputs after an excursion, shape (q,), and the rows that follow once the state is restored, shape (k, q)."""
    go_elsewhere(runner, distance)
    away = runner.outputs()
    runner.component.restore(state)
    return again(runner, saved_at, path), away


def solver_tolerance(runner: Runner) -> float:
    """Relative tolerance that the solver in the FMU may be thought to have.

    Args:
        runner: the instance under test.
    """
    return max(runner.component.tolerance or 0.0, USUAL_TOLERANCE)


def _evaluated(first: np.ndarray, trips: Sequence[_Trip], tolerance: float, problem: str) -> Restoring:
    """Compare the rows after saving, shape (k, q), with those after each excursion; `tolerance` is the solver's,
    relative.
    """
    verdict: Restores = "within_tolerance"
    mismatch, furthest = 0.0, np.zeros(first.shape[1])
    size = np.max(np.abs(first), axis=0)
    scale = np.maximum(size, np.abs(trips[0][1] - first[0]))  # an output may be near zero just then
    for rows, away in trips:
        apart, moved = largest(first, np.array(rows)), np.abs(away - first[0])
        rounding = apart <= ROUNDING * np.maximum(size, 1.0)
        solver = (apart <= SOLVER_FACTOR * tolerance * scale) & (apart <= _REMAINDER * moved)
        if not np.all(rounding | solver):
            verdict = "no"
        shares = apart / np.maximum(scale, np.finfo(float).tiny)
        mismatch = max(mismatch, float(np.max(np.where(rounding, 0.0, shares))))
        furthest = np.maximum(furthest, apart)
    return Restoring(verdict, mismatch, furthest, problem)


def near(runner: Runner, first: Sequence[np.ndarray], redone: Sequence[np.ndarray]) -> bool:
    """Whether two runs differ by no more than the solver in the FMU may make of it.

    Args:
        runner: the instance under test.
        first: outputs after each step, each of shape (q,).
        redone: the same of the other run.
    """
    rows = np.array(first)
    size = np.max(np.abs(rows), axis=0)
    slack = SOLVER_FACTOR * solver_tolerance(runner) * size + ROUNDING * np.maximum(size, 1.0)
    return bool(np.all(largest(rows, np.array([redone])) <= slack))


def largest(first: np.ndarray | Sequence[np.ndarray], redone: np.ndarray) -> np.ndarray:
    """Largest differences of each output, shape (q,), between rows that should agree; infinite where only one is a
    number.

    Args:
        first: rows, shape (k, q).
        redone: the same of one or more other runs, shape (..., k, q).
    """
    a, b = np.broadcast_arrays(np.asarray(first), redone)
    with np.errstate(invalid="ignore"):  # infinite values of one sign do not differ
        apart = np.where((a == b) | (np.isnan(a) & np.isnan(b)), 0.0, np.abs(a - b))
    return np.asarray(np.max(np.where(np.isnan(apart), np.inf, apart), axis=tuple(range(apart.ndim - 1))))
