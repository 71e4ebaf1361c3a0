"""What a filter believes: a value, and the choice between two of them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from plant_models.hybrid import Array


class Belief(NamedTuple):
    """What a filter believes.

    Attributes:
        estimate: shape (n,). spread: its covariance, or the lower factor of it, shape (n, n). drawn: what a prediction
            hands on to the correction after it, or None.
    """

    estimate: Array
    spread: Array
    drawn: Any = None


def chosen(begun: Array, one: Belief, other: Belief) -> Belief:
    """The one belief where a filter has begun, else the other.

    Args:
        begun: whether it has. one, other: of the same shapes.
    """

    def fields(a: Any, b: Any) -> Any:
        if a is None:
            return None
        return (
            type(a)(*(fields(*pair) for pair in zip(a, b, strict=True)))
            if isinstance(a, tuple)
            else np.where(begun, a, b)
        )

    return Belief(*(fields(*pair) for pair in zip(one, other, strict=True)))
