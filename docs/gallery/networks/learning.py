"""Runs of the adaptive observers beside the time-varying oscillator of Hann 2014, (4.64): one member a period."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from fmu_observer.models.known_models import find_state_affine_model
from fmus import Batch
from plant_models.hybrid import HybridSystem

GRID = 0.01  # [s]
RHO = np.array([10.0, 20.0])


class Learning(NamedTuple):
    """What was told over time.

    Args:
        t: instants [s], shape (k,). error: norm of the state's error, shape (members, k). reported: outputs, in the
            order that was asked for, shape (members, k, outputs).
    """

    t: np.ndarray
    error: np.ndarray
    reported: np.ndarray


@cache
def oscillation(model: str, end: float) -> Any:
    """The motion of the oscillator from the published start, a function of time; of many instants at once it is
    cheapest.

    Args:
        model: the oscillator or its excited variant, by name. end: of the motion [s].
    """
    flow, none = find_state_affine_model(model).flow, np.zeros(1)
    return solve_ivp(
        lambda t, x: np.asarray(flow(t, x, RHO, none)),
        (0.0, end),
        [20.0, -40.0],
        "DOP853",
        rtol=1e-10,
        atol=1e-9,
        max_step=0.1,
        dense_output=True,
    ).sol


def learn(
    observer: HybridSystem,
    periods: Sequence[float],
    end: float,
    outputs: Sequence[str] = ("rho1", "rho2"),
    preset: str | None = None,
) -> Learning:
    """Runs from the published starts, without noise, the first sample at time 0.

    Args:
        observer: adaptive, of the oscillator or of its excited variant. periods: one a member [s]. end: of the runs
            [s]. outputs: by name. preset: of the observer.
    """
    sol = oscillation(observer.model.name, end)  # type: ignore[attr-defined]
    batch = Batch(observer, len(periods), preset)
    batch.start()
    stamps = [period * np.arange(int(end / period) + 1) for period in periods]
    members = np.repeat(np.arange(len(periods)), [len(own) for own in stamps])
    reported = np.concatenate(stamps)
    batch.notify("sample", members, reported, x1=sol(reported)[0])
    t = GRID * np.arange(round(end / GRID) + 1)
    rows = batch.run(t[1:], ["x1", "x2", *outputs])
    error = np.hypot(*(rows[:, :, j] - sol(t)[j] for j in (0, 1)))
    return Learning(t, error, rows[:, :, 2:])


def settled(t: np.ndarray, bad: np.ndarray) -> float:
    """When something is bad for the last time [s].

    Args:
        t: instants [s]. bad: whether it is, at each of them.
    """
    return float(t[np.flatnonzero(bad)[-1]])
