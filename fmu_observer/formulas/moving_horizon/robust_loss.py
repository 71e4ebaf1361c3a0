"""Robust losses as weights of least squares, by how far a residual is off in its own deviations. Pure functions that
trace.

With the weight of the residual before, weighted least squares descends the loss: iteratively reweighted least squares.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from plant_models.hybrid import Array

Loss = Literal["squares", "huber", "geman_mcclure"]
LOSSES: tuple[Loss, ...] = ("squares", "huber", "geman_mcclure")
SCALES = {"squares": 1.0, "huber": 1.345, "geman_mcclure": 3.0}
"""Deviations at which a loss begins to doubt: 95 % efficiency for Huber (Huber 1964), three deviations [ours]."""


def weight(loss: Loss, squared: Array, scale: Array) -> Array:
    """Weight of a measurement in least squares.

    Args:
        loss: ``squares`` (1 always), ``huber`` (an outlier pulls with a bounded force: ``c / r`` beyond c), or
            ``geman_mcclure`` (a far outlier does not pull: ``1 / (1 + r^2 / c^2)^2``).
        squared: square r^2 of the residual in its standard deviations, any shape.
        scale: c, deviations at which the loss begins to doubt.

    Returns:
        From 0 to 1, the shape of `squared`.
    """
    if loss == "squares":
        return 1.0 + 0.0 * squared
    share = squared / (scale * scale)
    if loss == "huber":
        return 1.0 / np.sqrt(np.maximum(share, 1.0))
    return 1.0 / ((1.0 + share) * (1.0 + share))


def cost(loss: Loss, squared: Array, scale: Array) -> Array:
    """The loss itself: half the square near zero.

    Args:
        loss: see `weight`. squared: r^2, any shape. scale: c.

    Returns:
        Not negative, the shape of `squared`.
    """
    if loss == "squares":
        return 0.5 * squared
    if loss == "huber":
        r = np.sqrt(squared)
        return np.where(r > scale, scale * (r - 0.5 * scale), 0.5 * squared)
    return 0.5 * squared / (1.0 + squared / (scale * scale))
