"""Runs of the robot arm behind a network of two nodes, many at once. Used by the scripts 10 to 14."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from fmu_observer.models.known_models import find_model
from fmu_observer.observers.generic.delayed.delayed_state_observer import Between, DelayedStateObserver
from fmus import Batch

LINK_ANGLE, PRINTED = "flexible_joint_arm", "flexible_joint_arm_as_printed"
STATES = ("motor_angle", "link_angle", "motor_speed", "link_speed")
PUBLISHED_START = (1.0, 3.0, 2.0, 0.5)
STEP, PERIOD, SHARE = 0.01, 0.005, 0.2  # [s] of the run, of the memory, and what one predictor remembers


@dataclass(frozen=True)
class Cell:
    """One run: time between packets and delay [s], and the seed of the noise."""

    interval: float
    delay: float
    seed: int = 0


@dataclass(frozen=True)
class Errors:
    """Instants [s], shape (k,); errors of the state now and of the state a delay ago, shape (cells, k, 4)."""

    t: np.ndarray
    now: np.ndarray
    delayed: np.ndarray

    def worst(self, last: float) -> np.ndarray:
        """Largest error of the state now over the last so many seconds, shape (cells,); inf where a run broke."""
        late = np.abs(self.now[:, self.t >= self.t[-1] - last]).max(axis=(1, 2))
        return np.where(np.isfinite(late), late, np.inf)


@cache
def arm_motion(model: str, stop: float) -> Any:
    """The motion of the arm from rest under ``0.1 sin t``, a function of time."""
    flow = find_model(model).flow
    return solve_ivp(
        lambda t, x: flow(x, np.array([0.1 * np.sin(t)])),
        (0.0, stop),
        np.zeros(4),
        "DOP853",
        rtol=1e-9,
        atol=1e-11,
        dense_output=True,
    ).sol


def arm_errors(
    cells: Sequence[Cell],
    model: str = PRINTED,
    *,
    theta: float = 5.0,
    predictors: int = 1,
    between: Between = "predicted",
    stop: float = 40.0,
    variance: float = 0.0,
    start: Sequence[float] = PUBLISHED_START,
    at_once: bool = False,
    beside: float = 0.0,
) -> Errors:
    """Errors of the observer; nodes send in turn, or with `at_once` both in each packet.

    The delayed state starts `beside` the truth.
    """
    motion, count = arm_motion(model, stop), max(predictors, 1)
    observer = DelayedStateObserver(
        model, predictors=predictors, memory_places=round(SHARE / PERIOD), between_samples=between
    )
    batch = Batch(observer, len(cells))
    delays = np.array([cell.delay for cell in cells])
    for name, value in {"theta": theta, "delay": delays, "memory_period": PERIOD, "internal_step": PERIOD}.items():
        batch.set(name, value)
    for name in STATES:
        batch.set(f"estimated_{name}", beside)
    if predictors:
        batch.set("prediction", np.tile(np.asarray(start, dtype=float), count))
    members, sent, stamps, nodes, noises = [], [], [], [], []
    for i, cell in enumerate(cells):
        numbers = np.arange(int((stop - cell.delay) / cell.interval) + 1)
        members.append(np.full(len(numbers), i))
        sent.append(numbers * cell.interval)
        stamps.append(numbers * cell.interval + cell.delay)
        nodes.append(0.0 * numbers if at_once else numbers % 2 + 1.0)
        noises.append(np.sqrt(variance) * np.random.default_rng(cell.seed).normal(size=(2, len(numbers))))
    reported = motion(np.concatenate(sent))[:2] + np.concatenate(noises, axis=1)  # all at once: each call costs
    batch.notify(
        "packet",
        np.concatenate(members),
        np.concatenate(stamps),
        node=np.concatenate(nodes),
        motor_angle=reported[0],
        link_angle=reported[1],
    )
    t = STEP * np.arange(round(stop / STEP) + 1)
    batch.start(0.0)
    names = [*STATES, *(f"delayed_{name}" for name in STATES)]
    found = batch.run(t[1:], names, {"drive": 0.1 * np.sin(t + 0.5 * STEP)})
    ago = motion(np.maximum(t - delays[:, None], 0.0).ravel()).reshape(4, len(cells), len(t)).transpose(1, 2, 0)
    return Errors(t, found[:, :, :4] - motion(t).T, found[:, :, 4:] - ago)
