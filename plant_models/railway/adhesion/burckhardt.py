"""The Burckhardt adhesion curve: adhesion coefficient over wheel slip, with its peak in closed form.

Plain NumPy that evaluates on numbers, on batches and on traced symbols alike; imports nothing of the package but the
array type.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from plant_models.hybrid import Array


@dataclass(frozen=True)
class BurckhardtCurve:
    """``mu(lam) = a1 (1 - exp(-a2 lam)) - a3 lam`` for ``lam >= 0``, odd in ``lam``.

    Two departures from the print. The branch for negative slip is printed with the exponent of the positive one and
    blows up (``mu(-0.1) = +23``); the odd extension ``mu(-lam) = -mu(lam)`` is used. The formula turns negative beyond
    140 to 165 % slip, which would let a spinning wheel brake the train; beyond 100 % slip the coefficient therefore
    stays at ``mu(1)``, the value of a fully sliding wheel.

    Args:
        a1: height of the exponential part [1].
        a2: steepness of the exponential part [1].
        a3: slope of the falling part [1].

    Source: Bouchama 2024, (3.12) and Table 3.2.
    """

    a1: Array
    a2: Array
    a3: Array

    def coefficient(self, slip: Array) -> Array:
        """Adhesion coefficient [1] at slip [1], any shape; odd, and never against the slip."""
        bounded = np.clip(slip, -1.0, 1.0)
        # Two one-sided exponentials: odd, free of overflow, and with the exact derivative a1*a2 - a3 at zero slip,
        # where sign(0) = 0 would hide the stiffness of the wheel from the implicit integrator.
        rise = np.expm1(self.a2 * np.minimum(bounded, 0.0)) - np.expm1(-self.a2 * np.maximum(bounded, 0.0))
        return self.a1 * rise - self.a3 * bounded

    def peak_slip(self) -> Array:
        """Slip of the largest coefficient, ``ln(a1 a2 / a3) / a2`` [1]."""
        return np.log(self.a1 * self.a2 / self.a3) / self.a2

    def peak(self) -> Array:
        """Largest coefficient [1], in closed form ``a1 - (a3 / a2) (1 + ln(a1 a2 / a3))``."""
        return self.a1 - self.a3 / self.a2 * (1.0 + np.log(self.a1 * self.a2 / self.a3))

    def initial_slope(self) -> Array:
        """Slope at zero slip, ``a1 a2 - a3`` [1]."""
        return self.a1 * self.a2 - self.a3


BURCKHARDT_NOMINAL = BurckhardtCurve(0.4287, 40.0, 0.3)
BURCKHARDT_DEGRADED = BurckhardtCurve(0.165, 25.0, 0.1)
