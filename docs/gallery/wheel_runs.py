"""Runs of the observers that learn on the way, past the balise groups of Amsterdam - Utrecht: many members at once.

A train accelerates from 100 km/h to 140 km/h, as in the shipped scenario, and goes on. Every reading of the odometer is
the mean speed over the last 200 ms, times ``1 + wheel_radius_error``, plus normal noise; it is held until the next one.
Every balise lies where it is said to lie, within normal noise, and is read at its instant. All noise is independent.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cosim.balises.layout import from_csv
from cosim.scenario.shipped import shipped_file
from fmus import Batch

PERIOD = 0.2  # [s] of the odometer
START = 3100.0  # [m]
SPEEDS, RISING = (27.7778, 38.8889), 55.6  # [m/s], [s]
BALISE_DEVIATION, ODOMETER_DEVIATION = 0.5, 0.05  # [m], [m/s]


class Learnt(NamedTuple):
    """What the observers told at the groups.

    Args:
        groups: positions of the groups [m], shape (groups,). instants: when they were passed [s], shape (groups,).
        error: estimated error of the wheel radius just behind each, shape (members, groups). deviation: its standard
            deviation as told, shape (members, groups).
    """

    groups: np.ndarray
    instants: np.ndarray
    error: np.ndarray
    deviation: np.ndarray


def position(t: np.ndarray) -> np.ndarray:
    """Position of the train [m].

    Args:
        t: instants [s].
    """
    slope = (SPEEDS[1] - SPEEDS[0]) / RISING
    rising = np.minimum(t, RISING)
    return START + SPEEDS[0] * rising + 0.5 * slope * rising**2 + SPEEDS[1] * np.maximum(t - RISING, 0.0)


def learn_wheel_radius(members: int, count: int, true_error: float = 0.01, seed: int = 0) -> Learnt:
    """Runs of `adaptive_wheel_radius` past the first groups ahead of the train.

    Args:
        members: number of runs. count: number of groups. true_error: of the wheel radius, the same in all. seed: of the
            noise.
    """
    layout = from_csv(shipped_file("amsterdam_utrecht").with_name("amsterdam_utrecht_balise_groups.csv"))
    ahead = sorted(b.position for b in layout.balises if b.position > START)
    groups = np.array(ahead[:count])
    fine = np.linspace(0.0, 600.0, 600001)
    instants = np.interp(groups, position(fine), fine)
    rng = np.random.default_rng(seed)
    grid = PERIOD * np.arange(int(instants[-1] / PERIOD) + 2)
    speed = np.diff(position(np.concatenate([[-PERIOD], grid]))) / PERIOD
    speed[0] = SPEEDS[0]
    readings = (1.0 + true_error) * speed + ODOMETER_DEVIATION * rng.normal(size=(members, len(grid)))
    reported = groups + BALISE_DEVIATION * rng.normal(size=(members, count))
    batch = Batch("adaptive_wheel_radius", members)
    for name, value in {"balise_deviation": BALISE_DEVIATION, "odometer_deviation": ODOMETER_DEVIATION}.items():
        batch.set(name, value)
    batch.set("reading_age", PERIOD)
    batch.set("odometer", readings[:, 0])
    batch.start()
    who = np.repeat(np.arange(members), count)
    batch.notify("balise", who, np.tile(instants, members), position=reported.ravel())
    names = ("wheel_radius_error", "wheel_radius_error_deviation")
    rows = batch.run(grid[1:], names, {"odometer": readings})
    behind = np.searchsorted(grid, instants)
    return Learnt(groups, instants, rows[:, behind, 0], rows[:, behind, 1])
