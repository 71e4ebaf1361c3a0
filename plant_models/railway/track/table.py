"""Tables of breakpoints, read without branching: what a track or a timetable is made of.

Plain NumPy on numbers, batches and traced symbols; a table is a pair of short vectors. Knows nothing of trains.
"""

from __future__ import annotations

import numpy as np

from plant_models.hybrid import Array

_SMALLEST_WIDTH = 1e-9  # equal abscissae make a jump, not a division by zero


def piecewise_linear(at: Array, abscissae: Array, ordinates: Array) -> Array:
    """Broken line through the points, constant before the first and after the last.

    A sum of clipped ramps: points may be repeated (padding), and two points with equal abscissae make a jump.

    Args:
        at: where to read, a scalar or shape (members,).
        abscissae: shape (n,) or (n, members), not decreasing.
        ordinates: shape (n,) or (n, members).

    Returns:
        The value there, of the shape of `at`.
    """
    value = ordinates[0]
    for i in range(ordinates.shape[0] - 1):
        width = np.maximum(abscissae[i + 1] - abscissae[i], _SMALLEST_WIDTH)
        value = value + (ordinates[i + 1] - ordinates[i]) * np.clip((at - abscissae[i]) / width, 0.0, 1.0)
    return value
