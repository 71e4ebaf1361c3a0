"""One driven and braked wheelset: slip, the force of the rail on it, and how it holds a standing vehicle.

Plain NumPy on numbers, batches and traced symbols. Knows the adhesion laws, and nothing of vehicles and trains.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from plant_models.hybrid import Array
from plant_models.railway.adhesion.law import AdhesionLaw


class Wheelset(NamedTuple):
    """A wheelset in its present state; ``J dw = r (F_t - F_ad)`` with dry friction ``r B`` where it is braked.

    The slip is ``(r w - v) / max(|v|, slip_floor)``, (3.13); the floor keeps it finite at standstill. Parameters read
    of ``p``:
    `wheel_radius` [m], `wheel_inertia` [kg.m2], `slip_floor` [m/s] and those of the law.

    Args:
        law: the adhesion law.
        rate: angular speed w [rad/s]. speed: of the vehicle v [m/s].
        traction: driving force at the rim, F_t >= 0 [N]. brake: braking force at the rim, B >= 0 [N].
        weight: on the wheelset [N]. degraded: 0 nominal .. 1 degraded adhesion.
    """

    law: AdhesionLaw
    rate: Array
    speed: Array
    traction: Array
    brake: Array
    weight: Array
    degraded: Array

    def slip(self, p: Any) -> Array:
        """Slip ratio [1]."""
        return (p.wheel_radius * self.rate - self.speed) / self._reference(p)

    def creep_force(self, p: Any) -> Array:
        """Force of the rail along the track by the adhesion curve [N]."""
        return self.law.coefficient(self.slip(p), self._reference(p), self.degraded, p) * self.weight

    def acceleration(self, p: Any) -> Array:
        """Angular acceleration without dry friction [rad/s2]."""
        return p.wheel_radius * (self.traction - self.creep_force(p)) / p.wheel_inertia

    def friction(self, p: Any) -> Array:
        """Dry friction of the brake [rad/s2]: it can lock the wheelset, never turn it backwards."""
        return p.wheel_radius * self.brake / p.wheel_inertia

    def hold(self, p: Any) -> Array:
        """Force [N] by which the standing, braked wheelset holds the vehicle beyond what the creep curve does already.

        A creep curve alone is a damper at standstill; a parked train would crawl. Up to the smaller of brake and
        adhesion limit the contact holds like dry friction. The hold fades between half and full slip: a sliding wheel
        has the friction of the curve. As in the single-mass locomotive.
        """
        limit = self.law.limit(self.degraded, p) * self.weight
        missing = np.maximum(np.minimum(self.brake, limit) - np.abs(self.creep_force(p)), 0.0)
        fading = np.clip(2.0 - 2.0 * np.abs(self.slip(p)), 0.0, 1.0)
        return np.where(self.rate == 0.0, missing * fading, 0.0)

    def _reference(self, p: Any) -> Array:
        return np.maximum(np.abs(self.speed), p.slip_floor)
