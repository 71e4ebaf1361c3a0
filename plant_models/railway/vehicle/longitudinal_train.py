"""The longitudinal train: one point with Davis resistance, brake and gradient, per unit mass or not.

Declares the continuous system; the forces stand in `longitudinal_forces`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import Array, PeriodicEvent, memory, parameter, state, vector
from plant_models.railway.track.track import GradientShape, ZoneAxis
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


class LongitudinalTrain(LongitudinalForces):
    """Train as one point: ``m dv = b_T u_T - b_B u_B - w(v) - m g i(p)``, ``dp = v``, ``w = a + b v + c v |v|``.

    `effort` is ``u_T`` where it is positive and ``-u_B`` where it is negative. The wheel rolls: `wheel_speed` is the
    speed; wheels that lock or spin are `wheel_fault` behind this train.

    The brake and the constant part of the resistance are dry friction: they stop the train and hold it, and never push
    it. The published equations, which are about a moving train, would drive it backwards.

    The fault models of the train (2.26)-(2.28): in case 1 the effort acts no more and a force ``F f`` does,
    `effort_loss` = 1 and `disturbance_force` = ``F f``; in case 2 a share f of the effort is lost and a force ``xi f``
    remains, `effort_loss` = f and `disturbance_force` = ``xi f``. Case 3 is a fault of the sensor, `wheel_fault`.

    The published Davis sets are per unit mass. With `mass` = 1 a newton is 1 m/s2. Sets with a negative `davis_c` are
    fits: above a speed they pull the train. `outside_fitted_range` says where the speed is outside `fitted_from` to
    `fitted_to`, while the train moves.

    `adhesion_limit` is what the rails can take, ``N delta0 / (1 + 0.01 v)`` (2.7), times the level of adhesion. It does
    not bound the effort here: what follows from too much effort is the matter of `wheel_fault`.

    Presets: `set_a` (default; section 3.2.3, where ``b_T = b_B = 0.1``), `set_b` (3.3.4), `set_c` (4.3.4), `set_d`
    (Table 5.1, low adhesion LoA), `set_e` (bad adhesion BaA), `set_f` (extremely bad adhesion EBA), `scenario_3_3_4`
    (set B with its grade, at 45 m/s). The levels of adhesion of D, E, F (0.5, 0.3, 0.1) are ours.

    Args:
        zones: zones of degraded adhesion along ``position`` or ``time``.
        zone_count: number of zones.
        gradient_shape: gradient ``constant`` between its points, or ``linear``.
        gradient_count: number of gradient points.
        railway: row of Table 2.1 that gives the default of `adhesion_at_rest`.

    Raises:
        ValueError: an unknown option, or a count below one.

    Source: Aguiar Cota 2019, (2.1), (2.2), (2.7), (2.8), (2.26)-(2.28) and Table 5.1; dry friction is ours.
    """

    name = "longitudinal_train"
    description = "Train as one point per unit mass: effort in, position, speed and adhesion limit out"
    source = "Aguiar Cota 2019, (2.1)-(2.8), (2.26)-(2.28), Tables 2.1 and 5.1"
    internal_step = 2e-3  # a stop is placed within 2e-6 m per m/s2 of braking; the motion would allow 10 ms
    states = (
        state("train_position", "m", 0.0, "Position of the train at start"),
        state("train_speed", "m/s", 0.0, "Speed of the train at start"),
    )
    frictions = ("train_speed",)
    presets = TRAIN_PRESETS

    def __init__(
        self,
        *,
        zones: ZoneAxis = "position",
        zone_count: int = 3,
        gradient_shape: GradientShape = "constant",
        gradient_count: int = 4,
        railway: str = "sncf_multi_motor_bogie",
    ) -> None:
        super().__init__(
            zones=zones,
            zone_count=zone_count,
            gradient_shape=gradient_shape,
            gradient_count=gradient_count,
            railway=railway,
        )
        self.switchings = self._track.edges

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Derivatives of position and speed without dry friction."""
        push = self._forces(t, x.train_position, x.train_speed, u, p).push
        return {"train_position": x.train_speed, "train_speed": push / p.mass}

    def friction(self, t: Array, x: Any, u: Any, p: Any) -> Array:
        """Dry friction on the speed [m/s2], shape (1,) or (1, members)."""
        return vector((p.davis_a + self._forces(t, x.train_position, x.train_speed, u, p).brake) / p.mass)

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        degraded = self._track.degraded(self.switches(t, x, u, p))
        return self._outputs(
            x.train_position, x.train_speed, self._forces(t, x.train_position, x.train_speed, u, p), degraded, p
        )

    def switching(self, t: Array, x: Any, u: Any, p: Any) -> Array:
        return vector(*self._track.beyond_edges(t, x.train_position, p))
