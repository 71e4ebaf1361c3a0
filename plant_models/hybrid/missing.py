"""Values that can be missing: NaN stands for one, as FMI has no other. Pure functions that trace.

What is missing is replaced before anything is computed with it: ``0 * NaN`` is NaN, in numbers and in derivatives.
"""

from __future__ import annotations

from typing import Any

import numpy as np

Array = Any  # as in `hybrid.system`, which needs this

MISSED_SAMPLES = "missed_samples"
"""Name under which whoever leaves out what is missing counts it: a local variable, or an output."""
LARGEST = float(np.finfo(np.float64).max)  # comparisons with NaN are false; ``y != y`` is simplified away in a trace


def is_there(value: Array) -> Array:
    """1 where there is a number, 0 where it is missing.

    Args:
        value: scalar or array.

    Returns:
        Of the same shape.
    """
    return np.where(np.abs(value) <= LARGEST, 1.0, 0.0)


def or_else(value: Array, other: Array) -> Array:
    """The value where there is one, else the other one.

    Args:
        value: scalar or array. other: of the same shape, or a number.
    """
    return np.where(np.abs(value) <= LARGEST, value, other)
