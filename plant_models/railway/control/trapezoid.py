"""A journey in closed form: up with one acceleration, hold, down with another, over a given distance. Pure
functions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from plant_models.hybrid import Array


@dataclass(frozen=True)
class Trapezoid:
    """Speed over time from rest to rest. Where the distance is too short for the top speed, it is a triangle.

    Args:
        top_speed: [m/s], > 0. acceleration, deceleration: [m/s2], both > 0. distance: [m], > 0.
    """

    top_speed: Array
    acceleration: Array
    deceleration: Array
    distance: Array

    @property
    def peak(self) -> Array:
        """Highest speed reached [m/s]."""
        a, d = self.acceleration, self.deceleration
        return np.minimum(self.top_speed, np.sqrt(2.0 * self.distance * a * d / (a + d)))

    @property
    def durations(self) -> tuple[Array, Array, Array]:
        """Times of acceleration, hold and braking [s]."""
        v, a, d = self.peak, self.acceleration, self.deceleration
        held = np.maximum(self.distance - 0.5 * v * v / a - 0.5 * v * v / d, 0.0)
        return v / a, held / v, v / d

    def speed(self, elapsed: Array) -> Array:
        """Speed [m/s] at a time since the departure [s].

        Args:
            elapsed: time since the departure [s].
        """
        rising = self.acceleration * elapsed
        falling = self.deceleration * (sum(self.durations) - elapsed)
        return np.maximum(np.minimum(np.minimum(rising, self.peak), falling), 0.0)

    def phase(self, elapsed: Array) -> Array:
        """0 before the departure, 1 accelerating, 2 holding, 3 braking, 4 arrived.

        Args:
            elapsed: time since the departure [s].
        """
        up, hold, down = self.durations
        later = [np.where(elapsed >= instant, 1.0, 0.0) for instant in (0.0, up, up + hold, up + hold + down)]
        return later[0] + later[1] + later[2] + later[3]

    def position(self, elapsed: Array) -> Array:
        """Distance run [m].

        Args:
            elapsed: time since the departure [s].
        """
        up, hold, down = self.durations
        rising = np.clip(elapsed, 0.0, up)
        held = np.clip(elapsed - up, 0.0, hold)
        falling = np.clip(elapsed - up - hold, 0.0, down)
        braked = self.peak * falling - 0.5 * self.deceleration * falling * falling
        return 0.5 * self.acceleration * rising * rising + self.peak * held + braked
