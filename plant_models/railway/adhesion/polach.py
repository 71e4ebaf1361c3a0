"""The Polach creep curve: adhesion coefficient over slip and speed, falling with the sliding speed.

Plain NumPy that evaluates on numbers, on batches and on traced symbols alike; only the search for the peak uses SciPy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from plant_models.hybrid import Array

KMH = 3.6  # km/h in one m/s
CREEP_STIFFNESS = 25.0


@dataclass(frozen=True)
class PolachCurve:
    """Creep curve of Polach in the slip ``s = v_g / v``, odd in ``s``.

    ``f = (2 mu / pi) (K_A eps / (1 + (K_A eps)^2) + atan(K_S eps))`` with ``eps = k s / mu`` and the friction
    coefficient ``mu = mu0 ((1 - A) exp(-B v_g) + A)``, which falls with the sliding speed ``v_g``.

    Units. The thesis names none for ``B`` and gives none of the contact patch's numbers. Its Table 4.5 settles both:
    the table comes out to four digits with ``v_g`` in **km/h** and ``k = G pi a b c_jj / (4 Q) = 25``. With ``v_g`` in
    m/s the same maxima can be had, but at optimal slips three times those of the table (independently measured). So
    ``B`` is in h/km here, and the methods take speeds in m/s and convert.
    The text orders the reductions ``K_A <= K_S``; its Table 3.1, and Polach, have ``K_S <= K_A <= 1``.

    Args:
        ka: reduction in the area of adhesion K_A [1].
        ks: reduction in the area of slip K_S [1].
        mu0: friction coefficient at zero sliding speed [1].
        ratio: friction at infinite sliding speed over that at zero, A [1].
        decay: decay of the friction with the sliding speed, B [h/km].
        stiffness: creep stiffness k [1].

    Source: Bouchama 2024, (3.4)-(3.10) and Table 3.1; after Polach, Wear 258 (2005) 992-1000.
    """

    ka: Array
    ks: Array
    mu0: Array
    ratio: Array
    decay: Array
    stiffness: Array = CREEP_STIFFNESS

    def friction(self, sliding: Array) -> Array:
        """Friction coefficient [1] at the sliding speed [m/s], even in it."""
        return self.mu0 * ((1.0 - self.ratio) * np.exp(-self.decay * KMH * np.abs(sliding)) + self.ratio)

    def coefficient(self, slip: Array, speed: Array) -> Array:
        """Adhesion coefficient [1], odd in the slip.

        Args:
            slip: sliding speed over speed [1].
            speed: speed the slip refers to, positive [m/s]; ``slip * speed`` is the sliding speed.
        """
        mu = self.friction(slip * speed)
        eps = self.stiffness * slip / mu
        return 2.0 * mu / np.pi * (self.ka * eps / (1.0 + (self.ka * eps) ** 2) + np.arctan(self.ks * eps))

    def initial_slope(self) -> Array:
        """Slope at zero slip, ``(2 / pi) k (K_A + K_S)`` [1], the same at every speed."""
        return 2.0 / np.pi * self.stiffness * (self.ka + self.ks)

    def peak(self, speed: float) -> tuple[float, float]:
        """Slip of the first maximum of the coefficient, and the coefficient there [1], at one speed; a search, not
        traceable.

        Not the largest value at any slip: above 60 km/h (dry) or 80 km/h (wet) that is the coefficient of a wheel that
        spins without bound, where the friction has ceased to fall. No controller seeks that, and no slip is near it.

        Args:
            speed: [m/s].

        Raises:
            ValueError: the speed is not positive, or the coefficient falls at no slip up to 10.
        """
        if speed <= 0.0:
            raise ValueError(f"The peak of a Polach curve needs a positive speed, got {speed} m/s.")
        slips = np.geomspace(1e-4, 10.0, 4000)
        falling = np.flatnonzero(np.diff(self.coefficient(slips, speed)) < 0.0)
        if falling.size == 0:
            raise ValueError(
                f"The Polach curve has no peak at {speed:.4g} m/s: its coefficient rises at all slips up to 10."
            )
        bounds = (slips[max(int(falling[0]) - 1, 0)], slips[int(falling[0]) + 1])
        found = scipy.optimize.minimize_scalar(
            lambda s: -self.coefficient(s, speed), bounds=bounds, method="bounded", options={"xatol": 1e-10}
        )
        return float(found.x), float(-found.fun)


POLACH_DRY = PolachCurve(1.0, 0.4, 0.55, 0.4, 0.6)
POLACH_WET = PolachCurve(0.3, 0.1, 0.30, 0.4, 0.2)
