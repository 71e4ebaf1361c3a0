"""Loss: the standard normal number below which a packet is lost, from the share that is to be lost. Pure, traceable."""

from __future__ import annotations

from typing import Any

import numpy as np

BEYOND = 38.0
"""No double of a standard normal number by Box and Muller lies beyond it."""

_A = (
    -39.69683028665376,
    220.9460984245205,
    -275.9285104469687,
    138.3577518672690,
    -30.66479806614716,
    2.506628277459239,
)
_B = (-54.47609879822406, 161.5858368580409, -155.6989798598866, 66.80131188771972, -13.28068155288572, 1.0)
_C = (
    -7.784894002430293e-3,
    -0.3223964580411365,
    -2.400758277161838,
    -2.549732539343734,
    4.374664141464968,
    2.938163982698783,
)
_D = (7.784695709041462e-3, 0.3224671290700398, 2.445134137142996, 3.754408661907416, 1.0)
_TAIL = 0.02425
_LEAST = 1e-300


def loss_threshold(fraction: Any) -> Any:
    """The number below which a share `fraction` of standard normal numbers lies.

    Args:
        fraction: 0 to 1 [1].

    Returns:
        The normal quantile, -38 for 0 and 38 for 1. By the rational approximation of P. J. Acklam: within 1.2e-9 of
        it, relatively.
    """
    tail = np.minimum(fraction, 1.0 - fraction)
    far = np.sqrt(-2.0 * np.log(np.maximum(np.minimum(tail, _TAIL), _LEAST)))
    outer = _polynomial(_C, far) / _polynomial(_D, far)
    q = np.maximum(tail, _TAIL) - 0.5
    inner = q * _polynomial(_A, q * q) / _polynomial(_B, q * q)
    lower = np.where(tail < _TAIL, outer, inner)
    inside = np.where(fraction < 0.5, lower, -lower)
    return np.where(fraction <= 0.0, -BEYOND, np.where(fraction >= 1.0, BEYOND, inside))


def _polynomial(coefficients: tuple[float, ...], x: Any) -> Any:
    """Highest power first."""
    value = coefficients[0]
    for coefficient in coefficients[1:]:
        value = value * x + coefficient
    return value
