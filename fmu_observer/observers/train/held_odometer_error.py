"""The error of observers whose odometer reading is held: their gain at a speed, its sizes, the error matrix. Pure
functions of speeds and parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import Any

import numpy as np

from fmu_observer.certificates.bounds.carried import decay_proven, level_squared
from fmu_observer.certificates.impulsive_error import ImpulsiveError
from plant_models.hybrid import Array


def first_gain(z: Array, p: Any) -> Array:
    """``gain[1] + gain_schedule (b + c z) / m`` [1/s].

    Args:
        z: speed that schedules it [m/s].
    """
    return p.gain[0] + p.gain_schedule * (p.davis_b + p.davis_c * z) / p.mass


def error_matrix(a11: float, p: Any) -> np.ndarray:
    """``A - K C`` of speed, disturbance and its rate, shape (3, 3).

    Args:
        a11: entry 11 [1/s], see `error_slopes`.
    """
    return np.array([[a11, -1.0, 0.0], [-float(p.gain[1]), 0.0, 1.0], [-float(p.gain[2]), 0.0, 0.0]])


def gain_level(p: Any, *speeds: Array) -> Array:
    """Largest level of the gain at scheduling speeds, and between them, for it is convex [1/s].

    Args:
        speeds: those speeds [m/s].
    """
    return _largest_root([level_squared(p.lyapunov_matrix, first_gain(z, p), p.gain[1], p.gain[2]) for z in speeds])


def gain_norm(p: Any, *speeds: Array) -> Array:
    """Largest Euclidean norm of the gain at scheduling speeds, and between them, for it is convex [1/s].

    Args:
        speeds: those speeds [m/s].
    """
    return _largest_root([first_gain(z, p) ** 2 + p.gain[1] ** 2 + p.gain[2] ** 2 for z in speeds])


def _largest_root(squares: Sequence[Array]) -> Array:
    return np.sqrt(reduce(np.maximum, squares))


def proven(a11: Array, p: Any) -> Array:
    """1 where the matrix proves the decay for an entry 11 of the error matrix, else 0.

    Args:
        a11: entry 11 [1/s], see `error_slopes`.
    """
    return decay_proven(p.lyapunov_matrix, a11, (p.gain[1], p.gain[2]), p.bound_decay)


def position_error(a11: float, p: Any) -> ImpulsiveError:
    """Error of position, speed, disturbance and its rate, of which a balise ends the first.

    Args:
        a11: entry 11 [1/s], see `error_slopes`.
    """
    generator = np.zeros((4, 4))
    generator[0, 1] = 1.0
    generator[1:, 1:] = error_matrix(a11, p)
    return ImpulsiveError.of(generator, np.diag([0.0, 1.0, 1.0, 1.0]), (0, 1, 2, 3))
