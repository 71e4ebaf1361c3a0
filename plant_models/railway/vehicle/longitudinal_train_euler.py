"""The longitudinal train in discrete time: the explicit Euler form of the same forces.

Declares the periodic update; the forces stand in `longitudinal_forces`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import Array, PeriodicEvent, memory, parameter
from plant_models.railway.vehicle.longitudinal_forces import TRAIN_PRESETS, LongitudinalForces


class LongitudinalTrainEuler(LongitudinalForces):
    """Train as one point in discrete time: ``x(k+1) = (I + A(x(k)) Dt) x(k) - Dt B_B u_B + Dt B_T u_T + Dt G(x(k))``.

    The update occurs at ``start + k * update_period``, k = 1, 2, ..., with the inputs held since; between updates the
    state stands. Forces, inputs, outputs, parameters and presets are those of `longitudinal_train`, of which this is
    the Euler form: its error is of order 1 in the period. The printed (2.9) has a plus sign in the difference quotient;
    (2.10) follows from the minus.

    Brake and constant resistance are dry friction here too: a train that would change its direction within an update
    under them alone stands.

    Args:
        zones: zones of degraded adhesion along ``position`` or ``time``.
        zone_count: number of zones.
        gradient_shape: gradient ``constant`` between its points, or ``linear``.
        gradient_count: number of gradient points.
        railway: row of Table 2.1 that gives the default of `adhesion_at_rest`.

    Raises:
        ValueError: an unknown option, or a count below one.

    Source: Aguiar Cota 2019, (2.9)-(2.10); dry friction is ours.
    """

    name = "longitudinal_train_euler"
    description = "Train as one point in discrete time: the Euler form of longitudinal_train"
    source = "Aguiar Cota 2019, (2.9)-(2.10)"
    internal_step = 1e-2  # nothing flows
    states = (
        memory("train_position", "m", 0.0, "Position of the train at start"),
        memory("train_speed", "m/s", 0.0, "Speed of the train at start"),
        memory("updating", "1", 0.0, "1 from the start on, where nothing is updated yet"),
    )
    own_parameters = (parameter("update_period", "s", 0.05, "Time between two updates Dt", min=1e-6),)
    events = (PeriodicEvent("update", "update_period", description="The state is updated"),)
    presets = TRAIN_PRESETS

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Position and speed one period later."""
        before = t - p.update_period
        forces = self._forces(before, x.train_position, x.train_speed, u, p)
        h = p.update_period * x.updating
        pushed = x.train_speed + h * forces.push / p.mass
        dry = h * (p.davis_a + forces.brake) / p.mass
        return {
            "train_position": x.train_position + h * x.train_speed,
            "train_speed": np.sign(pushed) * np.maximum(np.abs(pushed) - dry, 0.0),
            "updating": 1.0,
        }

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        position, speed = x.train_position, x.train_speed
        passed = [np.where(beyond >= 0.0, 1.0, 0.0) for beyond in self._track.beyond_edges(t, position, p)]
        return self._outputs(position, speed, self._forces(t, position, speed, u, p), self._track.degraded(passed), p)
