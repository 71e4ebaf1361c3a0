"""A train of one locomotive and four wagons, Table 4.2, solved by SciPy: the truth for the augmented observers.

Wheels roll without slip and without inertia, so that the force at the rail is given; positions are relative to neutral
couplers.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

MASSES = np.array([90000.0, 19000.0, 19000.0, 19000.0, 19000.0])
DAVIS = np.array([[900.0, 32.4, 1.6529], *[[190.0, 6.8, 2.3]] * 4])
STIFFNESS, DAMPING, GRAVITY = 2.5e6, 5e4, 9.81
ROWS = 0.01  # [s], inputs of the observers are renewed so often


@dataclass(frozen=True)
class Journey:
    """Rows every `ROWS` seconds: time [s], force at the rail [N], position and speed of the locomotive, first coupler's
    force.
    """

    time: np.ndarray
    force: np.ndarray
    position: np.ndarray
    speed: np.ndarray
    coupler_force: np.ndarray
    gradient: float

    @property
    def gradient_force(self) -> float:
        """Gravity's pull on the locomotive [N]."""
        return float(MASSES[0] * GRAVITY * self.gradient)


def couplers(positions: np.ndarray, speeds: np.ndarray) -> np.ndarray:
    """Forces of the four couplers, pull positive [N]."""
    return -STIFFNESS * np.diff(positions) - DAMPING * np.diff(speeds)


def journey(force: Callable[[float], float], edges: list[float], gradient: float = 0.0) -> Journey:
    """The train from a speed of 0.5 m/s under a force that is smooth between `edges` [s]; ends at the last of them."""

    def flow(t: float, state: np.ndarray) -> np.ndarray:
        positions, speeds = state[:5], state[5:]
        pull = couplers(positions, speeds)
        resistance = DAVIS[:, 0] + DAVIS[:, 1] * speeds + DAVIS[:, 2] * speeds**2 + MASSES * GRAVITY * gradient
        forces = np.append(0.0, pull) - np.append(pull, 0.0) - resistance
        forces[0] += force(t)
        return np.concatenate([speeds, forces / MASSES])

    state, start = np.concatenate([np.zeros(5), np.full(5, 0.5)]), 0.0
    times, states = [], []
    for end in edges:
        at = np.round(np.arange(round(start / ROWS), round(end / ROWS)) * ROWS, 6)
        found = solve_ivp(flow, (start, end), state, method="DOP853", rtol=1e-8, atol=1e-8, t_eval=np.append(at, end))
        times.append(at)
        states.append(found.y[:, :-1])
        state, start = found.y[:, -1], end
    time, rows = np.concatenate(times), np.concatenate(states, axis=1)
    pull = np.array([couplers(r[:5], r[5:])[0] for r in rows.T])
    return Journey(time, np.array([force(t) for t in time]), rows[0], rows[5], pull, gradient)


def trip(
    cruise: float = 35.0 / 3.6, acceleration: float = 0.5, gradient: float = 0.008, length: float = 80.0
) -> Journey:
    """Accelerate, then hold the speed [m/s] uphill: what the whole train needs, in two steps."""
    reached = (cruise - 0.5) / acceleration

    def need(speed: float) -> float:
        return float((DAVIS @ [1.0, speed, speed**2]).sum() + MASSES.sum() * GRAVITY * gradient)

    def force(t: float) -> float:
        if t < reached:
            return need(0.5 + acceleration * t) + float(MASSES.sum()) * acceleration
        return need(cruise)

    return journey(force, [round(reached, 2), length], gradient)
