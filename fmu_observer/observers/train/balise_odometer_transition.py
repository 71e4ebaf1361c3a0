"""How the error of `BaliseOdometerEkf` moves between two events: transition and covariance. Pure functions."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from fmu_observer.formulas.filtering.kalman import integrated_noise
from plant_models.hybrid import Array
from plant_models.railway.vehicle.resistance import GRAVITY

ORDER = 4
P, V, D, CREEP = range(ORDER)  # places of the estimates among themselves


class Transition(NamedTuple):
    """What happens to the error between two events.

    Attributes:
        F: transition of the error, shape (4, 4). QN: covariance that it gets, shape (4, 4).
    """

    F: Array
    QN: Array


def transition(elapsed: Array, speed: Array, effort: Array, p: Any) -> Transition:
    """Transition of the error over a time, and the covariance that it gets on the way.

    Dry friction holds a train that stands, whatever pulls at it: then its speed is known as well as a reading shows it,
    and no reading says anything of position, disturbance and creep.

    Args:
        elapsed: time since the last event [s]. speed: [m/s]. effort: [N].
    """
    moves, fade = _moves(speed, p), np.exp(-elapsed * fading(speed, p))
    return Transition(_error_transition(elapsed, speed, moves, fade, p), _noise(elapsed, speed, effort, moves, fade, p))


def _error_transition(T: Array, speed: Array, moves: Array, fade: Array, p: Any) -> Array:
    """F over a time T [s], by a series of the drag slope to its third order, shape (4, 4)."""
    slope = -(p.davis_b + 2.0 * p.davis_c * np.abs(speed)) / p.mass
    z = slope * T
    stays = moves * (1.0 + z * (1.0 + z * (0.5 + z / 6.0)))
    once, twice = moves * T * (1.0 + z * (0.5 + z / 6.0)), moves * 0.5 * T * T * (1.0 + z / 3.0)
    zero = 0.0 * T
    one = 1.0 + zero
    rows = ([one, once, twice, zero], [zero, stays, once, zero], [zero, zero, one, zero], [zero, zero, zero, fade])
    return np.vstack([np.hstack(row) for row in rows])


def _noise(T: Array, speed: Array, effort: Array, moves: Array, fade: Array, p: Any) -> Array:
    """QN over a time T [s] as if there were no drag, shape (4, 4)."""
    zero = 0.0 * T
    by_acceleration = integrated_noise(2, T, moves * p.acceleration_density)
    by_disturbance = integrated_noise(3, T, moves * (p.disturbance_density + _drift(speed, effort, p)))
    driven = np.minimum(np.abs(effort) / (p.mass * p.creep_effort), 1.0)
    creep = np.square(p.creep_share * driven * speed) * (1.0 - fade * fade)
    unseen = (1.0 - moves) * np.square(p.odometer_deviation)
    rows = []
    for i in range(3):
        shared = [by_acceleration[i, j] if max(i, j) < 2 else zero for j in range(3)]
        shared[i] = shared[i] + (unseen if i == V else zero)
        rows.append(np.hstack([*(by_disturbance[i, j] + shared[j] for j in range(3)), zero]))
    return np.vstack([*rows, np.hstack([zero, zero, zero, creep])])


def _moves(speed: Array, p: Any) -> Array:
    """1 where the train is faster than a reading can distinguish from standing, else 0."""
    return np.where(np.abs(speed) > p.odometer_deviation, 1.0, 0.0)


def fading(speed: Array, p: Any) -> Array:
    """Rate at which a creep fades [1/s]; a wheel that stands does not creep.

    Args:
        speed: [m/s].
    """
    return 1.0 / np.where(_moves(speed, p) > 0.0, p.creep_time, p.odometer_period)


def _drift(speed: Array, effort: Array, p: Any) -> Array:
    """Spectral density with which the disturbance drifts since gradient and effort change [m2/s5]: twice the variance
    over the time in which each becomes another one.
    """
    by_gradient = np.square(GRAVITY * p.gradient_deviation) * np.abs(speed) / p.gradient_length
    return 2.0 * (by_gradient + np.square(p.effort_share * effort / p.mass) / p.effort_time)
