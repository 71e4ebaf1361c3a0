"""A bound that is carried over samples: the size of an error in the norm of a quadratic form, for errors of order
three. Pure functions that CasADi can trace.

Where ``P F + F' P + 2 m P <= 0`` holds for ``de = F e + w``, the level ``W = sqrt(e' P e)`` obeys
``dW <= -m W + |w|_P``. It needs no factor beta, neither at its start nor at a sample: a sample leaves e as it is. Only
where one component is asked for the norm is left: ``|C e| <= sqrt(C inv(P) C') W``.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import Array

_ORDER = 3


def level(P: Any, a: Array, b: Array, c: Array) -> Array:
    """``sqrt(z' P z)`` of ``z = (a, b, c)``.

    Args:
        P: symmetric, shape (3, 3). a, b, c: components of z.
    """
    return np.sqrt(np.maximum(level_squared(P, a, b, c), 0.0))


def level_squared(P: Any, a: Array, b: Array, c: Array) -> Array:
    """``z' P z`` of ``z = (a, b, c)``.

    Args:
        P: symmetric, shape (3, 3). a, b, c: components of z.
    """
    p11, p12, p13, p22, p23, p33 = _upper(P)
    return a * (p11 * a + 2.0 * (p12 * b + p13 * c)) + b * (p22 * b + 2.0 * p23 * c) + p33 * c * c


def level_of_box(P: Any, a: Array, b: Array, c: Array) -> Array:
    """Largest level of all errors with components up to a, b and c in size: that of the worst corner of the box.

    Args:
        P: symmetric, shape (3, 3). a, b, c: largest sizes of the components, none negative.
    """
    corners = [level_squared(P, a, x, y) for x, y in ((b, c), (b, -c), (-b, c), (-b, -c))]
    return np.sqrt(np.maximum(np.maximum(corners[0], corners[1]), np.maximum(corners[2], corners[3])))


def first_component(P: Any) -> Array:
    """``sqrt(C inv(P) C')`` with ``C = [1 0 0]``: the largest first component of an error of level 1.

    Args:
        P: symmetric, shape (3, 3), positive definite.
    """
    minor = P[1, 1] * P[2, 2] - P[1, 2] * P[1, 2]
    determinant = _determinant(*_upper(P))
    return np.sqrt(np.maximum(minor, 0.0) / np.where(determinant > 0.0, determinant, 1.0))


def decay_proven(P: Any, a11: Array, gain: Any, m: Array) -> Array:
    """1 where P is positive definite and ``P F + F' P + 2 m P`` negative definite, else 0, with
    ``F = [[a11, -1, 0], [-k2, 0, 1], [-k3, 0, 0]]``, by the signs of leading minors.

    Args:
        P: symmetric, shape (3, 3). a11: entry of F [1/s], ``-drag slope - k1``. gain: (k2, k3). m: decay rate [1/s].
    """
    k2, k3 = gain
    p11, p12, p13, p22, p23, p33 = upper = _upper(P)
    # entries of P F, row by row
    f11, f12, f13 = p11 * a11 - p12 * k2 - p13 * k3, -p11, p12
    f21, f22, f23 = p12 * a11 - p22 * k2 - p23 * k3, -p12, p22
    f31, f32, f33 = p13 * a11 - p23 * k2 - p33 * k3, -p13, p23
    Q = (
        -2.0 * (f11 + m * p11),
        -(f12 + f21 + 2.0 * m * p12),
        -(f13 + f31 + 2.0 * m * p13),
        -2.0 * (f22 + m * p22),
        -(f23 + f32 + 2.0 * m * p23),
        -2.0 * (f33 + m * p33),
    )
    return _positive_definite(*upper) * _positive_definite(*Q)


def _upper(P: Any) -> tuple[Array, ...]:
    """Entries 11, 12, 13, 22, 23, 33."""
    return tuple(P[i, j] for i in range(_ORDER) for j in range(i, _ORDER))


def _positive_definite(p11: Array, p12: Array, p13: Array, p22: Array, p23: Array, p33: Array) -> Array:
    second, third = p11 * p22 - p12 * p12, _determinant(p11, p12, p13, p22, p23, p33)
    return np.where(p11 > 0.0, 1.0, 0.0) * np.where(second > 0.0, 1.0, 0.0) * np.where(third > 0.0, 1.0, 0.0)


def _determinant(p11: Array, p12: Array, p13: Array, p22: Array, p23: Array, p33: Array) -> Array:
    return p11 * (p22 * p33 - p23 * p23) - p12 * (p12 * p33 - p23 * p13) + p13 * (p12 * p23 - p22 * p13)
