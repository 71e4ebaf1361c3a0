"""The longitudinal train: one point with Davis resistance, brake and gradient, per unit mass or not, continuous and in
Euler steps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar, NamedTuple

import numpy as np

from plant_models.hybrid import Array, HybridSystem, PeriodicEvent, vector
from plant_models.hybrid.option import require_chosen
from plant_models.hybrid.signal import Signal, input_signal, memory, output_signal, parameter, warning_output
from plant_models.railway.adhesion.adhesion_table import STANDING_ADHESION, adhesion_coefficient
from plant_models.railway.track.track import GradientShape, Track, ZoneAxis
from plant_models.railway.vehicle.resistance import DAVIS_SETS, DavisSet, gradient_resistance, moving_resistance
from plant_models.railway.vehicle.train_signals import DOWNHILL_PULL, FREE_FALL, POINT_OUTPUTS, POINT_STATES


class _Forces(NamedTuple):
    """Forces on the train [N], each a scalar or shape (members,).

    Args:
        push: sum of all that flows with the motion: traction, disturbance, moving resistance and gradient.
        moving: speed-dependent part of the Davis resistance. gradient: downhill pull as a resistance.
        brake: largest dry friction of the brake.
    """

    push: Array
    moving: Array
    gradient: Array
    brake: Array


class _LongitudinalForces(HybridSystem):
    """Base of the trains that are one point: signals, presets and forces of (2.1), (2.2), (2.7) and (2.26)-(2.28).

    Source: Aguiar Cota 2019, section 2.1.1 and (2.26)-(2.28).
    """

    inputs = (
        input_signal("effort", "N", 0.0, "Effort demanded: traction > 0, brake < 0"),
        input_signal("effort_loss", "1", 0.0, "Share of the effort that is lost, 0 to 1", optional=True),
        input_signal("disturbance_force", "N", 0.0, "Unknown force along increasing position", optional=True),
    )
    outputs: tuple[Signal, ...] = (
        *POINT_OUTPUTS,
        output_signal("wheel_speed", "m/s", "Circumferential speed of a wheel that rolls", display_unit="km/h"),
        output_signal("resistance_force", "N", "Davis resistance, against the motion"),
        DOWNHILL_PULL,
        output_signal("adhesion_limit", "N", "Largest force that the rails can take"),
        warning_output(
            "outside_fitted_range",
            "1 where the speed is outside the range of the Davis coefficients",
            "the train left the speeds from fitted_from to fitted_to in which its Davis coefficients hold, and a "
            "set with davis_c < 0 pulls it at high speed: take another set, or set the range that you accept",
            ("speed", "resistance_force"),
            variability="continuous",
        ),
    )
    default_preset = "set_a"
    option_choices = {
        "zones": ("position", "time"),
        "zone_count": range(1, 65),
        "gradient_shape": ("constant", "linear"),
        "gradient_count": range(1, 65),
        "railway": tuple(STANDING_ADHESION),
    }
    own_parameters: ClassVar[tuple[Signal, ...]] = ()

    def __init__(
        self,
        *,
        zones: ZoneAxis = "position",
        zone_count: int = 3,
        gradient_shape: GradientShape = "constant",
        gradient_count: int = 4,
        railway: str = "sncf_multi_motor_bogie",
    ) -> None:
        require_chosen(self.name, self.option_choices, railway=railway)
        self._track = Track(zones, zone_count, gradient_shape, gradient_count)
        if self.frictions:  # it flows
            self.switchings = self._track.edges
        self.parameters = (*_vehicle(railway), *self.own_parameters, *self._unused_zones())
        super().__init__(
            zones=zones,
            zone_count=zone_count,
            gradient_shape=gradient_shape,
            gradient_count=gradient_count,
            railway=railway,
        )

    def requirements(self, p: Any) -> dict[str, Array]:
        """Zones have a length and do not overlap; the range of the fit is one."""
        ordered = "fitted_to must not lie below fitted_from"
        return {**self._track.requirements(p), ordered: np.where(p.fitted_to >= p.fitted_from, 1.0, 0.0)}

    # -- forces -----------------------------------------------------------------------------------------------------

    def _forces(self, t: Array, position: Array, speed: Array, u: Any, p: Any) -> _Forces:
        """All forces at a time [s], a position [m] and a speed [m/s]."""
        working = 1.0 - np.clip(u.effort_loss, 0.0, 1.0)
        traction = p.traction_coefficient * working * np.maximum(u.effort, 0.0)
        brake = p.brake_coefficient * working * np.maximum(-u.effort, 0.0)
        moving = moving_resistance(speed, p.davis_b, p.davis_c)
        wave = p.mass * p.grade_amplitude * np.sin(p.grade_rate * t)
        gradient = gradient_resistance(p.mass, p.gravity, self._track.gradient(position, p)) + wave
        return _Forces(traction + u.disturbance_force - moving - gradient, moving, gradient, brake)

    def _outputs(self, position: Array, speed: Array, forces: _Forces, degraded: Array, p: Any) -> dict[str, Array]:
        """The declared outputs; at rest the forces are those that hold the train."""
        push, at_rest, direction = forces.push, speed == 0.0, np.sign(speed)
        dry = np.where(at_rest, np.clip(push, -p.davis_a, p.davis_a), direction * p.davis_a)
        freed = np.sign(push) * np.maximum(np.abs(push) - p.davis_a - forces.brake, 0.0)
        moves = np.where(at_rest, freed, push - direction * (p.davis_a + forces.brake))
        size = np.abs(speed)
        level = p.adhesion_level * (1.0 + degraded * (p.degraded_level - 1.0))
        weight = p.adhesive_share * p.mass * p.gravity
        outside = np.where(size < p.fitted_from, 1.0, np.where(size > p.fitted_to, 1.0, 0.0))
        return {
            "position": position,
            "speed": speed,
            "acceleration": moves / p.mass,
            "wheel_speed": speed,
            "resistance_force": forces.moving + dry,
            "gradient_force": forces.gradient,
            "adhesion_limit": weight * level * adhesion_coefficient(size, p.adhesion_at_rest),
            "outside_fitted_range": np.where(at_rest, 0.0, outside),
        }

    def _unused_zones(self) -> tuple[Signal, ...]:
        """Parameters of the track; no zone is laid unless it is asked for, along time neither."""
        unused = {"zone_from": 0.0, "zone_to": 0.0}
        return tuple(
            parameter(s.name, s.unit, unused[s.name], s.description, size=s.size) if s.name in unused else s
            for s in self._track.parameters
        )


def _davis_preset(chosen: DavisSet) -> dict[str, float]:
    """Parameter values of a published set, per unit mass: newtons are m/s2."""
    return {
        "mass": 1.0,
        "traction_coefficient": chosen.effort_coefficient,
        "brake_coefficient": chosen.effort_coefficient,
        "davis_a": chosen.a,
        "davis_b": chosen.b,
        "davis_c": chosen.c,
        "fitted_from": chosen.fitted_from,
        "fitted_to": chosen.fitted_to,
        "adhesion_level": chosen.adhesion_level,
    }


_TRAIN_PRESETS: dict[str, Mapping[str, Any]] = {
    **{name: _davis_preset(chosen) for name, chosen in DAVIS_SETS.items() if name != "set_b_observer"},
    "scenario_3_3_4": {
        **_davis_preset(DAVIS_SETS["set_b"]),
        "grade_amplitude": 0.05,
        "grade_rate": 0.1,
        "train_speed": 45.0,
    },
}
"""Presets of the trains: Davis sets A to F, and set B on the grade ``0.05 sin(0.1 t)`` of section 3.3.4 at 45 m/s."""


_HELD = ("position", "speed", "wheel_speed")
"""What follows from the state alone, which stands between updates; other outputs follow inputs and time too."""


class LongitudinalTrainEuler(_LongitudinalForces):
    """Train as one point in discrete time: ``x(k+1) = (I + A(x(k)) Dt) x(k) - Dt B_B u_B + Dt B_T u_T + Dt G(x(k))``.

    The update occurs at ``start + k * update_period``, k = 1, 2, ..., with the inputs held since; between updates the
    state stands. Forces, inputs, outputs, parameters and presets are those of `longitudinal_train`, of which this is
    the Euler form: its error is of order 1 in the period. The printed (2.9) has a plus sign in the difference quotient;
    (2.10) follows from the minus.

    Brake and constant resistance are dry friction here too: a train that would change its direction within an update
    under them alone stands.

    Options are those of `LongitudinalTrain`.

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
    outputs = (
        *(signal for signal in _LongitudinalForces.outputs if signal.name not in _HELD),
        *(replace(s, variability="discrete") for s in _LongitudinalForces.outputs if s.name in _HELD),
    )
    own_parameters = (parameter("update_period", "s", 0.05, "Time between two updates Dt", min=1e-6),)
    events = (PeriodicEvent("update", "update_period", description="The state is updated"),)
    presets = _TRAIN_PRESETS

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


class LongitudinalTrain(_LongitudinalForces):
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
    states = POINT_STATES
    frictions = ("train_speed",)
    presets = _TRAIN_PRESETS

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


def _vehicle(railway: str) -> tuple[Signal, ...]:
    return (
        parameter("mass", "kg", 1.0, "Mass of the train; 1 where forces are per unit mass", min=1e-3),
        parameter("traction_coefficient", "1", 0.1, "Force of one newton of traction demanded, b_T", min=0.0),
        parameter("brake_coefficient", "1", 0.1, "Force of one newton of brake demanded, b_B", min=0.0),
        parameter("davis_a", "N", 0.01, "Running resistance, constant part; dry friction", min=0.0),
        parameter("davis_b", "N.s/m", 0.1, "Running resistance, viscous part"),
        parameter("davis_c", "N.s2/m2", 0.001, "Running resistance, aerodynamic part; may be negative in a fit"),
        parameter(
            "fitted_from", "m/s", 0.0, "Lowest speed of the fit of the Davis coefficients", min=0.0, display_unit="km/h"
        ),
        parameter(
            "fitted_to", "m/s", 50.0, "Highest speed of the fit of the Davis coefficients", min=0.0, display_unit="km/h"
        ),
        FREE_FALL,
        parameter("grade_amplitude", "m/s2", 0.0, "Amplitude of a grade term that swings in time, sine, uphill > 0"),
        parameter("grade_rate", "rad/s", 0.1, "Angular frequency of that term", min=0.0),
        parameter(
            "adhesion_at_rest",
            "1",
            STANDING_ADHESION[railway],
            "Adhesion coefficient on dry rails at standstill",
            min=0.0,
        ),
        parameter(
            "adhesion_level", "1", 1.0, "Share of the dry adhesion: 1 dry, 0.5 LoA, 0.3 BaA, 0.1 EBA", min=0.0, max=1.0
        ),
        parameter("degraded_level", "1", 0.3, "Further share within a zone of degraded adhesion", min=0.0, max=1.0),
        parameter("adhesive_share", "1", 1.0, "Share of the mass on motored and braked axles", min=0.0, max=1.0),
    )
