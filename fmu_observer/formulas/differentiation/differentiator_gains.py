"""Gains of the homogeneous differentiators: data only.

Levant's table of non-recursive gains as printed in Bouchama 2024, Table 1.1. Row m belongs to the order m (n + nf for a
filtering differentiator); the first entry, 1.1, multiplies the equation with the bare sign.
"""

from __future__ import annotations

LEVANT_GAINS: tuple[tuple[float, ...], ...] = (
    (1.1,),
    (1.1, 1.5),
    (1.1, 2.12, 2.0),
    (1.1, 3.06, 4.18, 3.0),
    (1.1, 4.57, 9.30, 10.03, 5.0),
    (1.1, 6.75, 20.26, 32.24, 23.72, 7.0),
)
