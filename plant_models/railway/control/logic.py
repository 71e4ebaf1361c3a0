"""Yes and no as numbers, 1 and 0, so that decisions trace: no branching on values. Knows only arrays."""

from __future__ import annotations

from functools import reduce

import numpy as np

from plant_models.hybrid import Array


def holds(condition: Array) -> Array:
    """1 where the condition holds, else 0."""
    return np.where(condition, 1.0, 0.0)


def every(*statements: Array) -> Array:
    """1 where all statements (0 or 1) are 1."""
    return reduce(np.minimum, statements)


def some(*statements: Array) -> Array:
    """1 where one of the statements (0 or 1) is 1."""
    return reduce(np.maximum, statements)


def either(statement: Array, yes: Array, no: Array) -> Array:
    """`yes` where the statement is 1, else `no`."""
    return np.where(statement > 0.5, yes, no)
