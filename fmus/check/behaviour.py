"""Behaviour: steps of any length, saved states, resets. Each check returns what is wrong in words, or nothing.

The master's probe and ``fmus check`` both evaluate by these functions, so that they cannot disagree.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fmus.check.runner import WARM_UP_STEPS, Runner, elsewhere

STEP_TOLERANCE = 0.01
"""A divided step may differ from a whole one by this share of the output's range over the last few steps: far above
any integration error, far below a lie, which errs by a good part of a step.

A share of the change alone says nothing: around a standstill or a steady state outputs creep, and what their last
digits do is the integrator's.
"""

UNEVEN = 0.3137
"""Where the whole step is divided: no simple fraction, so that it is no multiple of an internal step."""

MICRO = 1e-4
"""A step of this share of the whole one must move the outputs, and by about that share of the change."""

_LARGER, _SMALLER = 1e-2, 1e-8
"""Where nothing moves in that, one of the first share must: own steps of an FMU that are finer do not matter. Where too
much moves, one of the second must move less: the FMU may be fast against the whole step.
"""

_MICRO_EXCESS = 20.0
"""By how much more a tiny step may move an output than its share: an output may start to move faster than on
average.
"""

_ENOUGH = 0.5
"""Share of the moving outputs that must behave."""

RESOLUTION = 1e-9
"""An output that changes by less than this share of itself over a step does not move."""

_DIVISIONS = ((0.5, 0.5), (UNEVEN, 1.0 - UNEVEN))


def repeatable(runner: Runner) -> str:
    """After a reset the same steps must give the identical outputs. From here on the runner resets where that works."""
    pattern = (runner.h,) * (2 * WARM_UP_STEPS)
    runner.begin()
    first = runner.steps(pattern)
    runner.reset_works = True
    runner.begin()
    problem = difference(runner, first, runner.steps(pattern))
    runner.reset_works = not problem
    return problem and f"after a reset {problem}"


def divided_steps(runner: Runner, scale: float = 1.0) -> str:
    """A whole step against the same step in two parts, even and uneven.

    Args:
        runner: the instance.
        scale: the whole step, in communication steps of the runner.
    """
    h = scale * runner.h
    rows = _rows(runner, (h,))
    start, whole = rows[-2:]
    moving = np.abs(whole - start) > RESOLUTION * np.abs(whole)
    floor = _floor(rows)
    for parts in _DIVISIONS:
        divided = _rows(runner, [h * part for part in parts])[-1]
        equal = np.abs(divided - whole) <= floor
        if not _enough(equal, moving):
            shares = " and ".join(f"{part:g}" for part in parts)
            found = worst(runner, whole, divided)
            return f"the outputs differ: a step of {h:g} s and one in parts of {shares} of it end apart, {found}"
    return ""


def ends_of_divided_steps(runner: Runner, h: float) -> list[np.ndarray]:
    """Outputs before a step of `h` [s], after it, and after it in the parts of `_DIVISIONS`, each of shape (q,).

    Args:
        runner: the instance under test.
    """
    return [*_rows(runner, (h,))[-2:], *(_rows(runner, [h * part for part in parts])[-1] for parts in _DIVISIONS)]


def _rows(runner: Runner, path: Sequence[float]) -> np.ndarray:
    """Outputs from the start on, after each step of the warm-up and of `path` [s], shape (k, q)."""
    return np.array([runner.begin(), *runner.steps(((runner.h,) * WARM_UP_STEPS) + tuple(path))])


def _floor(rows: np.ndarray) -> np.ndarray:
    """What is nothing beside the movement of each output, shape (q,), in rows of shape (k, q) from the start on."""
    return np.asarray(RESOLUTION * np.abs(rows[-1]) + STEP_TOLERANCE * _range(rows))


def _range(rows: np.ndarray) -> np.ndarray:
    """The range of each output, shape (q,); without the first row, as some FMUs compute outputs in steps only."""
    return np.asarray(np.ptp(rows[1:], axis=0))


def short_step(runner: Runner) -> str:
    """The first change after a short step: a tiny step must move the outputs, by about its share of a whole one.

    Args:
        runner: the instance under test.
    """
    rows = _rows(runner, (runner.h, runner.h))
    problem, other = _tiny_step(runner, rows, MICRO)
    return problem and _tiny_step(runner, rows, other)[0] and problem


def _tiny_step(runner: Runner, rows: np.ndarray, share: float) -> tuple[str, float]:
    """What is wrong with two tiny steps after a short one, in words, and the share of others that may go well.

    Args:
        runner: the instance under test.
        rows: outputs from the start up to the end of two whole steps, shape (k, q). share: of the first of these.
    """
    h, changes = runner.h, np.abs(np.diff(rows[-3:], axis=0))
    moving = np.all(changes > _floor(rows), axis=0)  # what stopped within the first step need not move in it
    moved = np.abs(np.diff(_rows(runner, (h * UNEVEN, h * share, h * share))[-3:], axis=0))
    seen = _MICRO_EXCESS * (share * changes[0] + MICRO * _range(rows))
    good = np.all((moved > 0.0) & (moved <= seen), axis=0) | runner.discrete  # which moves at events only
    if not moving.any() or _enough(good, moving):
        return "", share
    still = bool(np.all(moved[:, moving & ~good] == 0.0))
    what = "nothing moves in it" if still else "it moves the outputs by more than its share"
    tiny = f"the outputs differ: after a step of {h * UNEVEN:g} s a tiny one of {h * share:g} s is not done, {what}"
    return tiny, _LARGER if still else _SMALLER


def honest_step(runner: Runner) -> str:
    """Steps of any length do what they say: divided ones and tiny ones, at the communication step of the runner."""
    return divided_steps(runner) or short_step(runner)


def continuation(runner: Runner) -> tuple[float, ...]:
    """The steps [s] by which continuations are compared.

    Args:
        runner: the instance under test.
    """
    h = runner.h
    return (h, UNEVEN * h, h, h) if runner.component.can_vary_step else (h, h, h)


def go_elsewhere(runner: Runner, distance: float = 1.0) -> None:
    """Some steps under other inputs, `distance` times as large, so that a restored state has something to undo.

    Args:
        runner: the instance under test.
    """
    runner.set_inputs(distance * elsewhere(runner.amplitude))
    runner.steps((runner.h,) * WARM_UP_STEPS)


def again(runner: Runner, saved_at: float, path: Sequence[float]) -> list[np.ndarray]:
    """Steps from a restored state of time `saved_at` [s] under the inputs of before.

    Args:
        runner: the instance under test.
        path: of the FMU.
    """
    runner.now = saved_at
    runner.set_inputs(runner.amplitude)
    return runner.steps(path)


def difference(runner: Runner, first: Sequence[np.ndarray], second: Sequence[np.ndarray]) -> str:
    """Where two runs that must be identical part, in words; nothing where they do not.

    Args:
        runner: the instance under test.
        first: outputs after each step, each of shape (q,).
        second: the same of the other run.
    """
    for number, (a, b) in enumerate(zip(first, second, strict=True), start=1):
        if not np.array_equal(a, b, equal_nan=True):
            return f"the outputs differ: in step {number} of {len(first)}, {worst(runner, a, b)}"
    return ""


def worst(runner: Runner, a: np.ndarray, b: np.ndarray) -> str:
    """The output that differs most between two rows, in words.

    Args:
        runner: the instance under test.
        a: outputs, shape (q,).
        b: outputs, shape (q,).
    """
    apart = np.abs(a - b) / np.maximum(np.maximum(np.abs(a), np.abs(b)), np.finfo(float).tiny)
    place = int(np.argmax(np.where(np.isnan(apart), np.inf, apart)))
    return f"{runner.output_names[place]} {float(a[place])!r} and {float(b[place])!r}"


def _enough(good: np.ndarray, moving: np.ndarray) -> bool:
    """Whether most of the moving outputs are good; of outputs that do not move, all must be."""
    return bool(np.mean(good[moving]) >= _ENOUGH) if moving.any() else bool(np.all(good))
