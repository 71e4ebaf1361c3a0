"""The finite-time predictor of a delayed state, one reading of its memory on. Pure functions.

``s = xi - z - int_{t - share}^t f(xi, u)`` obeys ``ds = -sqrt|s| sgn(s)``: its signed root falls at the rate 1/2 until
it is zero. So it is moved on in closed form, and the predicted state follows from it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from plant_models.hybrid import Array

_ITERATIONS = 3  # of the implicit end of the trapezoidal rule; each wins a factor of 2 / (period Lipschitz)


class Prediction(NamedTuple):
    """What a predictor remembers.

    Args:
        state: predicted, n scalars. rates: of it, for each state the newest first. roots: signed roots of s, n scalars.
    """

    state: list[Array]
    rates: list[list[Array]]
    roots: list[Array]


def moved_on(
    before: Prediction,
    base: list[Array],
    rate_at: Callable[[list[Array]], Array],
    first: Array,
    weights: list[Array],
    period: Array,
    share: Array,
) -> Prediction:
    """A predictor after a reading: Hann 2014, (2.46) and (2.57).

    Args:
        before: at the reading before. base: state that it predicts from, n scalars. rate_at: the model's rate at a
            state. first: whether this is the first reading: the past is then constant. weights: of the integral over
            the share, the present first [1]. period: of the memory [s]. share: of the delay [s].

    Returns:
        The predictor now; its rates have one place more, the newest in front.
    """
    indices = range(len(base))
    start = rate_at(before.state)
    old = [[np.where(first, start[i], rate) for rate in before.rates[i]] for i in indices]
    past = [period * weighted(weights[1:], old[i]) for i in indices]
    distance = [before.state[i] - base[i] - share * start[i] for i in indices]  # of a constant past
    now = [np.sign(d) * np.sqrt(np.abs(d)) for d in distance]
    less = [np.sign(r) * np.maximum(np.abs(r) - 0.5 * period, 0.0) for r in before.roots]
    roots = [np.where(first, now[i], less[i]) for i in indices]
    fixed = [base[i] + past[i] + roots[i] * np.abs(roots[i]) for i in indices]
    x = [before.state[i] + period * old[i][0] for i in indices]
    for _ in range(_ITERATIONS):
        rate = rate_at(x)
        x = [fixed[i] + period * weights[0] * rate[i] for i in indices]
    state = [np.where(first, before.state[i], x[i]) for i in indices]
    rate = rate_at(state)
    return Prediction(state, [[rate[i], *old[i]] for i in indices], roots)


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
