"""Aerodynamics of a wind turbine's rotor: power coefficient and torque. Pure formulas; they know only NumPy.

The table of the power coefficient is not printed in the thesis. What stands here is a stand-in: Heier's formula, scaled
to the largest coefficient of the benchmark. Where it is used, its page says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from plant_models.hybrid import Array

HEIER_LARGEST = 0.48
"""Largest power coefficient of Heier's formula, at a tip speed ratio of 8.1 and zero pitch [1]."""

LEAST_WIND, LEAST_RATIO = 0.1, 0.1  # [m/s], [1]: below them the formula is held, so that nothing is divided by zero


def _power_coefficient(ratio: Array, pitch: Array, largest: Array) -> Array:
    """Share of the wind's power that the rotor takes, by Heier's formula (a stand-in for the table that is missing).

    ``1 / l = 1 / (ratio + 0.08 b) - 0.035 / (b^3 + 1)`` and ``Cp = c (0.5176 (116 / l - 0.4 b - 5) exp(-21 / l) +
    0.0068 ratio)``, with c chosen so that the largest value is `largest`.

    Source: Heier, Grid Integration of Wind Energy, 1998; its place in the benchmark is ours.
    """
    blade = np.maximum(pitch, 0.0)
    inverse = 1.0 / (ratio + 0.08 * blade) - 0.035 / (blade * blade * blade + 1.0)
    shape = 0.5176 * (116.0 * inverse - 0.4 * blade - 5.0) * np.exp(-21.0 * inverse) + 0.0068 * ratio
    return largest / HEIER_LARGEST * shape


class Rotor(NamedTuple):
    """Rotor with three blades; each parameter a number or of shape (members,).

    Args:
        radius: R [m]. air_density: rho [kg/m3]. largest_coefficient: largest power coefficient [1].
    """

    radius: Array = 57.5
    air_density: Array = 1.225
    largest_coefficient: Array = 0.4554

    def torque(self, wind: Array, speed: Array, pitches: Sequence[Array]) -> Array:
        """Torque of the wind on the rotor, a third of it from each blade.

        ``sum_i rho pi R^3 Cp(lambda, beta_i) v^2 / (6 lambda)``, ``lambda = speed R / v``. The thesis prints a 2 in
        place of the 6, which is three times the power.

        Args:
            wind: speed of the wind v [m/s]. speed: of the rotor [rad/s]. pitches: angles of the three blades [deg].

        Returns:
            Torque [N.m], of the shape of `speed`.

        Source: Omar 2012, (7.3.1), repaired.
        """
        blowing = np.maximum(wind, LEAST_WIND)
        ratio = np.maximum(speed * self.radius / blowing, LEAST_RATIO)
        taken = sum(_power_coefficient(ratio, pitch, self.largest_coefficient) for pitch in pitches)
        swept = np.pi * self.radius * self.radius * self.radius
        return self.air_density * swept / 6.0 * taken * blowing * blowing / ratio


def optimal_torque_gain(rotor: Rotor, efficiency: float, gear_ratio: float, best_ratio: float = 8.0) -> float:
    """Gain of ``torque = gain * generator_speed^2`` that holds the rotor at its best tip speed ratio.

    Args:
        rotor: with numbers. efficiency: of the drive train [1]. gear_ratio: of the gear [1].
        best_ratio: tip speed ratio of the largest power coefficient [1].

    Returns:
        ``rho pi R^5 eta Cp_max / (2 (lambda Ng)^3)`` [N.m.s2/rad2]; 1.21708 with the numbers of the benchmark.

    Source: Omar 2012, section 7.2.2.
    """
    swept = rotor.air_density * np.pi * rotor.radius**5 * rotor.largest_coefficient
    return float(0.5 * swept * efficiency / (best_ratio * gear_ratio) ** 3)
