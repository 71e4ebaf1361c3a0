"""The velocity-dependent part of the Davis resistance and its slope, as the observers use them. Pure functions."""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import Array


def rolling_drag(speed: Array, p: Any) -> Array:
    """``b v + c v |v|`` [N], against the motion in both directions (Bouchama 2024, (3.14) without the constant term).

    Args:
        speed: train speed [m/s].
        p: named tuple with `davis_b` [N.s/m] and `davis_c` [N.s2/m2].
    """
    return p.davis_b * speed + p.davis_c * speed * np.abs(speed)


def drag_slope_range(p: Any, slowest: float, fastest: float) -> tuple[float, float]:
    """Smallest and largest ``(b + 2 c v) / M`` [1/s] over speeds from `slowest` to `fastest` [m/s].

    Not a linearisation: ``c (w^2 - v^2) = 2 c m (w - v)`` with m the mean of the two speeds, so the range holds for
    errors of any size as long as that mean stays within the speeds given.
    """
    return (p.davis_b + 2.0 * p.davis_c * slowest) / p.mass, (p.davis_b + 2.0 * p.davis_c * fastest) / p.mass
