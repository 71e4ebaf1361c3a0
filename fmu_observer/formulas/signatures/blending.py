"""Blending of a model's prediction with an estimate that comes from a window of measurements. A pure function that
traces; it knows nothing but NumPy.
"""

from __future__ import annotations

import numpy as np

from plant_models.hybrid import Array


def blended(predicted: Array, estimate: Array, gain: Array, ready: Array = 1.0) -> Array:
    """``(x_m + q x_s) / (1 + q)``, the filter (4.6.8) and (4.7.9) of Omar 2012.

    The estimate enters with the weight q / (1 + q): 0.0099 for q = 0.01, 0.0909 for 0.1, 0.1667 for 0.2, 0.2308 for
    0.3. q = 0 leaves the model to itself.

    Args:
        predicted: x_m(k|k-1), what the model made of the last blended estimate, shape (n,). estimate: x_s(k), of the
            window and brought to the same instant, shape (n,). gain: q [1], not negative.
        ready: 1 once the window is full, before which the prediction stands alone.

    Returns:
        Shape (n,).
    """
    return np.where(ready > 0.5, (predicted + gain * estimate) / (1.0 + gain), predicted)
