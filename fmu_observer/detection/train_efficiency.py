"""How much of the traction and of the brake reaches the train: window inversion on the train as one point.

Pure functions that trace; the formulas of the inversion are those of `fmu_observer.formulas.diagnosis`.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from fmu_observer.formulas.diagnosis.window_inversion import Inverted, grid_around, invert, smoothed
from plant_models.hybrid import Array, vector
from plant_models.hybrid.scan import Arrays, enclosed, scan

GRID = 5  # values of the parameter, as in the thesis


class MotionWindow(NamedTuple):
    """Means over the coarse steps of a window, oldest first, each a list of M.

    Attributes:
        speed: [m/s]. drive: acceleration that traction would give [m/s2]. measured: deceleration by the measured brake
            pressure [m/s2]. demanded: deceleration by the pressure that was asked for [m/s2]. other: acceleration by
            the electric brake and the gradient [m/s2].
    """

    speed: list[Array]
    drive: list[Array]
    measured: list[Array]
    demanded: list[Array]
    other: list[Array]


class Share(NamedTuple):
    """Share of a force that arrives.

    Attributes:
        value: smoothed [1]. found: 1 where this window gave a value, else 0. bracketed: 1 where the share lies within
            the grid that was searched, else 0: then `value` goes to the nearer end.
    """

    value: Array
    found: Array
    bracketed: Array


def between(means: list[Array]) -> list[Array]:
    """What acts between the middles of neighbouring steps.

    Args:
        means: over the steps, M of them.

    Returns:
        M - 1 values.
    """
    return [0.5 * (a + b) for a, b in pairwise(means)]


def _simulated_change(start: Array, forces: list[Array], step: Array, mass: Array, davis: Array) -> Array:
    """Speed at the end of the window [m/s], by Euler steps from middle to middle.

    Args:
        start: speed at its start [m/s]. forces: accelerations without resistance [m/s2]. step: [s].
        mass: with the rotating masses [kg]. davis: coefficients of the resistance [N], [N.s/m], [N.s2/m2], three.
    """
    speed = start
    for force in forces:
        resistance = davis[0] + davis[1] * speed + davis[2] * speed * np.abs(speed)
        speed = np.maximum(speed + step * (force - resistance / mass), 0.0)
    return speed


def _share_of(
    parts: list[Array], rest: list[Array], window: MotionWindow, previous: Array, step: Array, mass: Array, p: Any
) -> Inverted:
    """Share of a force at which the simulated speed at the end of the window is the measured one [1].

    In generated C this is one function, called for each force.

    Args:
        parts: acceleration by the whole force [m/s2], signed. rest: all others [m/s2]. window: for the speeds.
        previous: share found last [1]. step: [s]. mass: [kg]. p: with the Davis coefficients,
            `least_share`, `most_share` and `smoothing`.

    Returns:
        The share, smoothed, and by how many intervals of the grid it was bracketed.

    Source:
        Omar 2012, 7.7.7, (7.7.7)-(7.7.8), for the train as one point.
    """
    known = (window.speed[0], window.speed[-1], step, mass, p.davis_a, p.davis_b, p.davis_c)
    settings = (p.least_share, p.most_share, p.smoothing)
    (found,) = enclosed(_inverted, vector(previous), vector(*parts), vector(*rest), vector(*known, *settings))
    return Inverted(found[0], found[1])


def _inverted(previous: Array, *others: Array) -> Arrays:
    """`_share_of` as a function of arrays alone."""
    return scan(_share, (), [(previous,)], others)[1][0]


def _share(_: Arrays, row: Arrays, shared: Arrays) -> tuple[Arrays, Arrays]:
    """`_share_of` of single elements: last share; parts, rest, and what is known in the order of `_share_of`."""
    previous, (parts, rest, known) = row[0][0], shared
    start, end, step, mass = (known[i] for i in range(4))
    grid = grid_around(previous, GRID, least=known[7], most=known[8])
    differences = []
    for share in grid:
        forces = [share * parts[i] + rest[i] for i in range(parts.shape[0])]
        differences.append(_simulated_change(start, forces, step, mass, known[4:7]) - end)
    found = invert(grid, differences, previous)
    return (), (vector(smoothed(previous, found.value, known[9]), found.crossings),)


def traction_share(window: MotionWindow, previous: Array, step: Array, mass: Array, p: Any) -> Share:
    """Share of the traction effort that reaches the train.

    Told where traction alone changes the speed by `least_excitation`, and the brake by less than a fifth of that.

    Args:
        window: means. previous: share found last [1]. step: of the window [s]. mass: [kg].
    """
    drive, brake, other = between(window.drive), between(window.demanded), between(window.other)
    pulled, braked = step * sum(drive), step * sum(brake)
    enough = np.where(pulled > p.least_excitation, np.where(braked < 0.2 * pulled, 1.0, 0.0), 0.0)
    rest = [o - b for o, b in zip(other, brake, strict=True)]
    found = enough * moving(window, p)
    return _share_where_found(_share_of(drive, rest, window, previous, step, mass, p), found, previous)


def brake_share(
    decelerations: list[Array], window: MotionWindow, previous: Array, step: Array, mass: Array, p: Any
) -> Share:
    """Share of the brake force that reaches the train.

    Told where the brake that was asked for alone changes the speed by `least_excitation`, and traction by less than a
    fifth of that.

    Args:
        decelerations: by the pressure, measured or demanded [m/s2], M of them. window: means. previous: share found
            last [1]. step: of the window [s]. mass: [kg].
    """
    drive, brake, other = between(window.drive), between(decelerations), between(window.other)
    pulled, braked = step * sum(drive), step * sum(between(window.demanded))
    enough = np.where(braked > p.least_excitation, np.where(pulled < 0.2 * braked, 1.0, 0.0), 0.0)
    rest = [o + d for o, d in zip(other, drive, strict=True)]
    found = enough * moving(window, p)
    parts = [-b for b in brake]
    return _share_where_found(_share_of(parts, rest, window, previous, step, mass, p), found, previous)


def _share_where_found(share: Inverted, found: Array, previous: Array) -> Share:
    """A share where the window shows one, else the last."""
    value = np.where(found > 0.0, share.value, previous)
    return Share(value, found, found * np.where(share.crossings > 0.5, 1.0, 0.0))


def moving(window: MotionWindow, p: Any) -> Array:
    """1 where the train moved faster than `least_speed` at both ends of the window, else 0.

    Args:
        window: means.
    """
    return np.where(np.minimum(window.speed[0], window.speed[-1]) > p.least_speed, 1.0, 0.0)
