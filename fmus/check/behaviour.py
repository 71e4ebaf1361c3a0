"""Behaviour: steps of any length, saved states, resets. Each check returns what is wrong in words, or nothing.

The master's probe and ``fmus check`` both evaluate by these functions, so that they cannot disagree.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fmus.check.runner import WARM_UP_STEPS, Runner, elsewhere

STEP_TOLERANCE = 0.01
"""A divided step may differ from a whole one by this share of the change: far above any integration error, far below a
lie.
"""

UNEVEN = 0.3137
"""Where the whole step is divided: no simple fraction, so that it is no multiple of an internal step."""

MICRO = 1e-4
"""A step of this share of the whole one must move the outputs, and by about that share of the change."""

_MICRO_EXCESS = 20.0
"""By how much more a tiny step may move an output than its share: an output may start to move faster than on
average.
"""

_ENOUGH = 0.5
"""Share of the moving outputs that must behave; a sampled one among them need not move in a tiny step."""

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
    start, whole, *all_divided = ends_of_divided_steps(runner, h)
    change = np.abs(whole - start)
    moving = change > RESOLUTION * np.abs(whole)
    for parts, divided in zip(_DIVISIONS, all_divided, strict=True):
        equal = np.abs(divided - whole) <= STEP_TOLERANCE * change + RESOLUTION * np.abs(whole)
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
    warm_up = (runner.h,) * WARM_UP_STEPS
    runner.begin()
    rows = runner.steps((*warm_up, h))[-2:]
    for parts in _DIVISIONS:
        runner.begin()
        rows.append(runner.steps((*warm_up, *(h * part for part in parts)))[-1])
    return rows


def short_step(runner: Runner) -> str:
    """The first change after a short step: a tiny step must move the outputs, by about its share of a whole one.

    Args:
        runner: the instance under test.
    """
    h, warm_up = runner.h, (runner.h,) * WARM_UP_STEPS
    runner.begin()
    start, whole = runner.steps((*warm_up, h))[-2:]
    change = np.abs(whole - start)
    moving = (change > RESOLUTION * np.abs(whole)) & ~runner.discrete  # a discrete output moves at events only
    runner.begin()
    at = np.array(runner.steps((*warm_up, h * UNEVEN, h * MICRO, h * MICRO))[-3:])
    moved = np.abs(np.diff(at, axis=0))
    small = np.all((moved > 0.0) & (moved <= _MICRO_EXCESS * MICRO * change), axis=0)
    if not moving.any() or _enough(small, moving):
        return ""
    still = bool(np.all(moved[:, moving & ~small] == 0.0))
    what = "nothing moves in it" if still else "it moves the outputs by more than its share"
    return f"the outputs differ: after a step of {h * UNEVEN:g} s a tiny one of {h * MICRO:g} s is not done, {what}"


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
