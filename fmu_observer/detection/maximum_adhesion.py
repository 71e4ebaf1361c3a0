"""Maps of the optimal slip and of the adhesion there over the train speed, from Polach's curves. NumPy, no state."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from plant_models.railway.adhesion.polach import POLACH_DRY, POLACH_WET, PolachCurve

KMH = 3.6  # km/h in one m/s
_MAP_KMH = (1, 2, 3, 4, 5, 6, 8, 10, 12.5, 15, 20, 25, 30, 40, 50, 60, 80, 110, 160)
MAP_SPEEDS = tuple(v / KMH for v in _MAP_KMH)
"""[m/s], from the lowest the thesis shows, and lower, to the speed limit of its line."""


@dataclass(frozen=True)
class AdhesionMap:
    """Optimal slip and adhesion there over the train speed.

    Attributes:
        speeds: [m/s], ascending. slips: slip of the largest adhesion coefficient, relative to the train speed [1].
        peaks: that coefficient [1].
    """

    speeds: tuple[float, ...]
    slips: tuple[float, ...]
    peaks: tuple[float, ...]


@lru_cache(maxsize=32)
def adhesion_map(curve: PolachCurve, speeds: tuple[float, ...] = MAP_SPEEDS) -> AdhesionMap:
    """Map of a creep curve, each point its first peak.

    Args:
        curve: with numbers, not symbols, for parameters. speeds: [m/s], positive.

    Raises:
        ValueError: a speed is not positive, or the curve has no peak there.

    Source: Bouchama 2024, (4.16) and Table 4.5, which the curves of its Table 3.1 give with the sliding speed in km/h
    and k = 25.
    """
    found = [curve.peak(float(speed)) for speed in speeds]
    return AdhesionMap(tuple(map(float, speeds)), tuple(slip for slip, _ in found), tuple(peak for _, peak in found))


def nominal_map() -> AdhesionMap:
    """Map of the dry rail, nominal adhesion."""
    return adhesion_map(POLACH_DRY)


def degraded_map() -> AdhesionMap:
    """Map of the wet rail, degraded adhesion."""
    return adhesion_map(POLACH_WET)


def published_map(degraded: bool) -> AdhesionMap:
    """Table 4.5 as printed on the speeds of `MAP_SPEEDS`: linear between its six speeds, constant outside 5 to 50
    km/h.

    Args:
        degraded: True for wet rail, False for dry.
    """
    speeds = np.array([5.0, 10.0, 20.0, 30.0, 40.0, 50.0]) / KMH
    slips = (0.304, 0.20, 0.144, 0.12, 0.096, 0.072) if degraded else (0.10, 0.08, 0.048, 0.04, 0.032, 0.032)
    peaks = (
        (0.2188, 0.1961, 0.1713, 0.1566, 0.1463, 0.1387)
        if degraded
        else (0.3894, 0.3474, 0.3027, 0.2769, 0.2594, 0.2449)
    )
    slips_there, peaks_there = (np.interp(MAP_SPEEDS, speeds, values) for values in (slips, peaks))
    return AdhesionMap(MAP_SPEEDS, tuple(map(float, slips_there)), tuple(map(float, peaks_there)))
