"""Memory of the recent past as a shift register: what stands at a fractional age, and integrals over the past.

Pure functions in plain NumPy; the newest value stands first. Ages and lengths are counted in places of the register.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from plant_models.hybrid import Array


def at_age(age: Array, values: Sequence[Array]) -> Array:
    """Value at an age, on the straight line between its neighbours; beyond the ends the last lines go on.

    Args:
        age: counted in places, 0 the newest. values: at ages 0, 1, 2, ..., two at least.
    """
    inside = np.clip(age, 0.0, len(values) - 1.0)
    found = sum(np.maximum(1.0 - np.abs(inside - i), 0.0) * value for i, value in enumerate(values))
    return found + np.minimum(age, 0.0) * (values[1] - values[0])


def integral_weights(length: Array, count: int) -> list[Array]:
    """Weights of the values at ages 0, 1, ..., `count` in the integral of the broken line through them.

    The trapezoidal rule, with a part of a place at the old end.

    Args:
        length: over which is integrated, from the newest on, counted in places. count: largest age.
    """
    places = [np.clip(length - i, -1.0, 1.0) for i in range(count + 1)]
    weights = [0.5 + y - 0.5 * y * np.abs(y) for y in places]  # integral of the hat up to y
    return [weights[0] - 0.5, *weights[1:]]


def weighted(weights: Sequence[Array], values: Sequence[Array]) -> Array:
    """Sum of the values times their weights.

    Args:
        weights: one a value. values: numbers or traced symbols.
    """
    return sum(weight * value for weight, value in zip(weights, values, strict=True))
