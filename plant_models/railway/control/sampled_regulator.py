"""The sampled PI regulator of a mass: gains by pole placement, anti-windup, bumpless change. Pure functions.

``F = ff + Kp e + I``, ``I+ = I + Ki T e + (1 - rho) (F_limited - F)``, with the double pole ``rho = exp(-omega T)``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from plant_models.hybrid import Array


@dataclass(frozen=True)
class RegulatorGains:
    """Gains of one regulator: `proportional` [N.s/m], `integral` already times the period [N.s/m], `tracking` [1]."""

    proportional: Array
    integral: Array
    tracking: Array

    def holding(self, force: Array, feedforward: Array, error: Array) -> Array:
        """Integral [N] with which it would have asked for just this force: what an inactive one holds.

        Args:
            force, feedforward: [N]. error: reference minus speed [m/s].
        """
        return force - feedforward - self.proportional * error

    def force(self, integral: Array, feedforward: Array, error: Array) -> Array:
        """Force asked for [N], before limits.

        Args:
            integral, feedforward: [N]. error: reference minus speed [m/s].
        """
        return feedforward + self.proportional * error + integral

    def next_integral(self, integral: Array, error: Array, cut_off: Array) -> Array:
        """Integral [N] for the next period.

        Args:
            integral: that of this period [N]. error: reference minus speed [m/s]. cut_off: limited minus wanted force
                [N], 0 between the limits.
        """
        return integral + self.integral * error + self.tracking * cut_off


def pole_placement(bandwidth: Array, mass: Array, period: Array) -> RegulatorGains:
    """Gains that put both poles of the mass under the sampled regulator at ``rho = exp(-bandwidth * period)``.

    With the effort held over a period ``T``, ``v+ = v + T F / M``. The characteristic polynomial of the error is
    ``(z - 1)^2 + (T Kp / M) (z - 1) + T^2 Ki / M``, equal to ``(z - rho)^2`` with ``Kp = 2 (1 - rho) M / T`` and
    ``Ki = (1 - rho)^2 M / T^2``. What a limit cuts off leaves the integral with the same pole ``rho``.

    Args:
        bandwidth: omega [rad/s], > 0. mass: mass to be moved M [kg]. period: control period T [s].

    Source: ours; no gains are printed (Bouchama 2024, section 4.5).
    """
    reach = -np.expm1(-bandwidth * period)
    return RegulatorGains(2.0 * reach * mass / period, reach * reach * mass / period, reach)
