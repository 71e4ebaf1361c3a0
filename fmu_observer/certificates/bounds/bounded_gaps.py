"""What a bound over time says of gaps: the largest one that keeps a limit."""

from __future__ import annotations

from collections.abc import Callable
from math import inf, isfinite

from fmu_observer.certificates.bisection import bisected

HORIZON = 1e4  # [s]: a bound that keeps its limit so long keeps it for ever
FIRST = 1e-3  # [s]
HALVINGS = 60  # of the bracket, to rounding


def largest_gap(
    bound: Callable[[float], float], limit: float, horizon: float = HORIZON, halvings: int = HALVINGS
) -> float:
    """Largest gap up to which a bound stays at or below a limit: the use that Aguiar Cota 2019, 4.2 makes of tau_M.

    The bounds of this room start at the error of the sample and cross a limit above that once: they are convex, or rise
    or fall to a last value. The crossing is enclosed by doubling and found by bisection.

    Args:
        bound: of the time since the sample [s]. limit: that it may not exceed, in its unit, positive.
        horizon: longest gap of interest [s]. halvings: of the bracket, a factor of two wide at first; fewer for a bound
            that is expensive.

    Returns:
        The gap [s]; 0 where the limit is exceeded at the sample already, inf where it is kept up to the horizon.

    Raises:
        ValueError: the limit is not a positive number.
    """
    if not (isfinite(limit) and limit > 0.0):
        raise ValueError(f"Largest gap: the limit must be a positive number, got {limit!r}.")
    if bound(0.0) > limit:
        return 0.0
    low, high = 0.0, FIRST
    while bound(high) <= limit:
        if high >= horizon:
            return inf
        low, high = high, min(2.0 * high, horizon)
    return bisected(lambda gap: bound(gap) <= limit, low, high, halvings)[0]
