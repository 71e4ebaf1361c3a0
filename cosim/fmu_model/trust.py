"""Whether the states of an FMU are all of its state, by measurement: written, read back, stepped, compared."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from math import ceil

import numpy as np

from cosim.fmu_model.sealed import Array, FmuModelError, SealedModel

STEPS = 3
SOLVER = 1e-3
"""What a restarted solver may make of a step, as a share of the change over it; a part of the state that was forgotten
makes more of it.
"""
_MOST_RESTARTS = 100
"""Restarts in a row by which steps of an FMU's own are looked for."""
ROUNDING = 1e-9
"""The same as a share of the values."""


@dataclass(frozen=True)
class _StateTrust:
    """What was seen of the states of an FMU.

    Attributes:
        way: how they are written. exact: whether a restart continued the run bit for bit.
        deviation: largest difference after a restart, as a share of the change over a step.
        idle: states whose value changes nothing in a step.
    """

    way: str
    exact: bool
    deviation: float
    idle: tuple[str, ...]


def usual_step(model: SealedModel) -> float:
    """The step of the FMU's default experiment [s], 10 ms where it has none.

    Args:
        model: the FMU.
    """
    declared = getattr(model.instance.description.defaultExperiment, "stepSize", None)
    return float(declared) if declared else 0.01


def check_states(model: SealedModel, h: float, t: float = 0.0) -> _StateTrust:
    """Measure whether the states determine what follows.

    A run of some steps is left at one of them, started again from the states read there, and compared with the run that
    went on. The inputs move at each step: where they do not, a held sample equals a fresh one. Then each state is
    moved, read back, and must change the step that follows.

    Args:
        model: the FMU. h: length of the steps [s]. t: start of the run [s].

    Returns:
        What was seen.

    Raises:
        FmuModelError: the states are not taken, do not determine what follows, or change nothing. The message says
            which finding it was and what to do.
    """
    _demand_own_steps_fit(model, t, model.start_inputs + 1.0, h)
    model.restart(t, model.start, _moving(model, 0))
    rows = [model.read()]
    for k in range(2 * STEPS):
        model.set_inputs(_moving(model, k))
        model.advance(t + k * h, h)
        rows.append(model.read())
    at, (x, _), u = t + STEPS * h, rows[STEPS], _moving(model, STEPS)
    _demand_read_back(model, at, x, u)
    model.restart(at, x, u)
    seen = [_continued(model, rows, k, t, h) for k in range(STEPS, 2 * STEPS)]
    idle = _idle(model, at, x, u, h)
    if len(idle) == len(model.states):
        raise FmuModelError(
            f"{model.path}: no state changes what follows ({', '.join(idle)}): the FMU does not start from the values "
            "given. No filter can move it; a particle filter over saved states only selects."
        )
    return _StateTrust(
        model.way, all(equal for _, equal in seen), max(0.0, *(deviation for deviation, _ in seen)), idle
    )


def _continued(model: SealedModel, rows: list[tuple[Array, Array]], k: int, t: float, h: float) -> tuple[float, bool]:
    """Step number `k` of the run that was started again: its deviation from `rows`, and whether it is the same."""
    model.set_inputs(_moving(model, k))
    model.advance(t + k * h, h)
    return _deviation(model, rows, k + 1, model.read(), t + (k + 1) * h)


def check_saving(model: SealedModel, h: float, t: float = 0.0) -> None:
    """Measure whether a saved state is all of the state: steps are made, taken back and made again.

    Args:
        model: the FMU. h: length of the steps [s]. t: start of the run [s].

    Raises:
        FmuModelError: it saves no states, or what follows a restored one is something else.
    """
    names = (*model.states, *model.outputs)
    model.restart(t, model.start, _moving(model, 0))
    model.advance(t, h)
    if not model.instance.can_save:
        raise FmuModelError(
            f"{model.path}: it does not declare that its state can be saved and restored, so no particle filter can "
            "select among states. Use 'ekf', 'ukf' or 'ensemble' where its states can be set."
        )
    saved = model.called(model.instance.save)
    runs = []
    for again in (False, True):
        if again:
            model.called(partial(model.instance.restore, saved))
        rows = []
        for k in range(1, 1 + STEPS):
            model.set_inputs(_moving(model, k))
            model.advance(t + k * h, h)
            rows.append(np.concatenate(model.read()))
        runs.append(rows)
    model.called(partial(model.instance.release, saved))
    run, redone = np.array(runs)
    apart = np.where((run == redone) | (np.isnan(run) & np.isnan(redone)), 0.0, np.abs(run - redone))
    change = np.abs(np.diff(run, axis=0)).max(axis=0)
    wrong = ~(apart <= SOLVER * change + ROUNDING * np.maximum(np.abs(run), 1.0))
    if wrong.any():
        k, i = (int(place[0]) for place in np.nonzero(wrong))
        raise FmuModelError(
            f"{model.path}: restored and stepped again, {names[i]} is {float(redone[k, i])!r}, and "
            f"{float(run[k, i])!r} before: its states cannot be saved and restored honestly, so no particle filter can "
            "select among them. Use 'ekf', 'ukf' or 'ensemble' where its states have start values."
        )


def _moving(model: SealedModel, k: int) -> Array:
    """Inputs of step k, shape (m,): others at each step, and other differences between inputs."""
    turned = 2.0 * k + 3.0 * np.arange(np.size(model.start_inputs))
    return np.asarray(model.start_inputs + 1.0 + 0.5 * np.sin(turned))


def _demand_own_steps_fit(model: SealedModel, t: float, u: Array, h: float) -> None:
    """Refuse an FMU whose own steps are longer than those asked for: started anew at each of them it never makes one.

    Looked at over two steps of its default experiment, where those are longer.
    """
    x = model.start
    count = min(ceil(2.0 * usual_step(model) / h - ROUNDING), _MOST_RESTARTS)
    if count <= STEPS:
        return
    model.restart(t, x, u)
    for k in range(count):
        model.advance(t + k * h, h)
    run, redone = model.read()[0], x
    for k in range(count):
        redone = model.transition(t + k * h, h, redone, u)[0]
    apart = np.abs(redone - run) - SOLVER * np.abs(run - x) - ROUNDING * np.maximum(np.abs(run), 1.0)
    if (apart > 0.0).any():
        i = int(np.argmax(apart))
        raise FmuModelError(
            f"{model.path}: started again at each of {count} steps of {h:g} s, {model.states[i]} is "
            f"{float(redone[i])!r} at the end, and {float(run[i])!r} in the run: the FMU has steps of its own that do "
            f"not fit into these. Use steps of {usual_step(model):g} s, those of its default experiment, or its model "
            "exchange."
        )


def _demand_read_back(model: SealedModel, t: float, x: Array, u: Array) -> None:
    for i, name in enumerate(model.states):
        moved = x.copy()
        moved[i] += 1e-3 * max(abs(x[i]), model.nominal(name))
        found, _ = model.values_at(t, moved, u)
        if abs(found[i] - moved[i]) > ROUNDING * max(abs(moved[i]), 1.0):
            raise FmuModelError(
                f"{model.path}: the state {name} was set to {float(moved[i])!r} and reads {float(found[i])!r} after "
                "initialisation: the FMU does not take it. Name another variable that holds this state, or use a "
                "particle filter over saved states."
            )


def _deviation(
    model: SealedModel, rows: list[tuple[Array, Array]], k: int, again: tuple[Array, Array], t: float
) -> tuple[float, bool]:
    """Largest deviation from row k of the run as a share of its change, and whether there is none at all."""
    run, redone = np.concatenate(rows[k]), np.concatenate(again)
    change = np.max(
        [np.abs(np.concatenate(rows[i]) - np.concatenate(rows[i - 1])) for i in range(1, len(rows))], axis=0
    )
    apart = demand_continued(model, run, redone, change, t)
    shares = apart / np.maximum(change, np.finfo(float).tiny)
    return float(np.max(np.where(apart <= ROUNDING * np.maximum(np.abs(run), 1.0), 0.0, shares))), bool(
        (run == redone).all()
    )


def demand_continued(model: SealedModel, run: Array, redone: Array, change: Array, t: float) -> Array:
    """Refuse an FMU that goes on otherwise from its states than in a run.

    Args:
        model: the FMU. run: its states and outputs after a step of a run, shape (n + q,).
        redone: the same after that step from a restart. change: largest change of each over a step. t: instant [s].

    Returns:
        How far both are apart, shape (n + q,).

    Raises:
        FmuModelError: a value is no finite number, or they are further apart than a solver makes them.
    """
    names = (*model.states, *model.outputs)
    broken = np.flatnonzero(~(np.isfinite(run) & np.isfinite(redone)))
    if len(broken):
        raise FmuModelError(f"{model.path}: {names[broken[0]]} is no finite number at t = {t:g} s.")
    apart = np.where(run == redone, 0.0, np.abs(run - redone))
    wrong = ~(apart <= SOLVER * change + ROUNDING * np.maximum(np.abs(run), 1.0))
    if wrong.any():
        i = int(np.argmax(np.where(wrong, apart / np.maximum(change, np.finfo(float).tiny), 0.0)))
        raise FmuModelError(
            f"{model.path}: started again from its states ({', '.join(model.states)}), {names[i]} is "
            f"{float(redone[i])!r} at t = {t:g} s, and {float(run[i])!r} in the run: the FMU holds more than these "
            "states (samples, delays, modes). Name the missing states, or use a particle filter over saved states."
        )
    return np.asarray(apart)


def _idle(model: SealedModel, t: float, x: Array, u: Array, h: float) -> tuple[str, ...]:
    """States that change nothing over a step, themselves included."""
    still = np.concatenate(model.transition(t, h, x, u))
    idle = []
    for i, name in enumerate(model.states):
        moved = x.copy()
        moved[i] += 1e-3 * max(abs(x[i]), model.nominal(name))
        if np.array_equal(np.concatenate(model.transition(t, h, moved, u)), still):
            idle.append(name)
    return tuple(idle)
