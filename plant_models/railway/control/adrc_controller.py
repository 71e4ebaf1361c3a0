"""The ADRC speed controller: active disturbance rejection on the odometer.

A controller as a hybrid system of its own; knows the hybrid foundation, the observer, the limits and the blending.
"""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

import numpy as np

from plant_models.hybrid import Array, HybridSystem, Signal, output_signal, parameter, state
from plant_models.hybrid.option import require_chosen
from plant_models.railway.control import effort_limits
from plant_models.railway.control.logic import either, every, holds

Drive = Literal["immediate", "ramped"]


class _Command(NamedTuple):
    """What is applied: electric effort [N], demand to the air brake [1], and 1 where the train is held at
    standstill.
    """

    effort: Array
    brake_demand: Array
    standing: Array


class AdrcController(HybridSystem):
    """Active disturbance rejection control of the odometer speed: ``F = M (wc (v_ref - z1) + a_ref - z2)``.

    An extended state observer of second order with both poles at ``-wo`` estimates from odometer and applied effort the
    speed ``z1`` and, as one acceleration ``z2``, everything that the model ``M dv = F`` leaves out: resistance,
    gradient, coupler, a wrong mass. With the right mass the speed follows the reference like ``wc / (s + wc)``, and a
    constant gradient leaves no error. The observer is fed with the effort behind all limits, so that a limit winds
    nothing up.

    The controller knows neither slip nor adhesion. When the wheels spin, the odometer shows them and not the train, and
    the effort is not reduced for it: that is what the published comparison shows (scenario Sc2).

    Brake: the electric brake follows the force, in service braking (reference below ``-service_deceleration``) the air
    brake takes it over and the electric brake fills the gap while air builds up. ``full_brake_force = 0`` is a train
    without air brake. Where the reference is zero, does not rise, and the odometer is below `standstill_speed`, the
    train is held.

    Gains: none are printed. Rule (ours): ``wc`` a decade below the slowest coupler mode (0.822 Hz = 5.2 rad/s), so that
    the controller does not excite couplers, 0.5 rad/s; ``wo = 3 wc``. An odometer of 10 Hz is then fast enough
    (``wo T = 0.15``).

    Drive: with ``drive="ramped"`` the effort follows the demand with `effort_lag` and moves by `effort_rate` at most
    (period and rate of the MDPE controller); the observer is fed with the effort that is there. A spinning wheel has a
    sixtieth of the train's inertia: without the rate the loop over a sampled odometer then swings between traction and
    brake at some hertz.

    Args:
        drive: ``immediate`` or ``ramped``.

    Raises:
        ValueError: an unknown drive.

    Presets: `train` (default; 166 t with air brake), `single_mass` (90 t without air brake: the plant `locomotive`).

    Source: Bouchama 2024, section 4.5 (that ADRC is used, on the odometer), section 4.1 (350 kN, 4.2 MW); law: Gao
    2003; gains, blending and hold are ours.
    """

    name = "adrc_controller"
    description = "ADRC speed controller on the odometer: extended state observer, effort and air brake demand out"
    source = "Bouchama 2024, sections 4.1 and 4.5; Gao 2003; gains ours"
    internal_step = 1e-2  # the observer's poles are at 1.5 rad/s
    states: tuple[Signal, ...] = (
        state("observed_speed", "m/s", 0.0, "Speed estimate z1 of the extended state observer"),
        state(
            "disturbance_acceleration", "m/s2", 0.0, "Disturbance estimate z2, against nothing but the model M dv = F"
        ),
        state("built_up_brake", "N", 0.0, "Force that the air brake is believed to have built up"),
    )
    inputs = (
        effort_limits.ODOMETER,
        *effort_limits.FOLLOWED,
    )
    outputs = (
        output_signal("effort", "N", "Effort demand of the locomotive's drive: traction > 0, electric brake < 0"),
        output_signal("brake_demand", "1", "Demand to the air brake, 0..1"),
        output_signal("disturbance_force", "N", "Everything that resists beyond M dv = F, as estimated: -M z2"),
    )
    parameters: tuple[Signal, ...] = (
        effort_limits.TRAIN_MASS,
        parameter("control_bandwidth", "rad/s", 0.5, "Bandwidth of the control law wc", min=1e-3),
        parameter("observer_bandwidth", "rad/s", 1.5, "Bandwidth of the extended state observer wo", min=1e-3),
        *effort_limits.DRIVE_AND_BRAKES,
        effort_limits.SERVICE_DECELERATION,
        effort_limits.HOLDING_EFFORT,
        parameter("standstill_speed", "m/s", 0.1, "Odometer speed below which it stands", min=0.0, display_unit="km/h"),
    )
    presets = effort_limits.PRESETS
    default_preset = "train"
    option_choices = {"drive": ("immediate", "ramped")}

    def __init__(self, *, drive: Drive = "immediate") -> None:
        require_chosen(self.name, self.option_choices, drive=drive)
        self._ramped = drive == "ramped"
        if self._ramped:
            self.states = (*self.states, state("drive_effort", "N", 0.0, "Effort of the drive"))
            self.parameters = (
                *self.parameters,
                parameter("effort_lag", "s", 0.1, "Time constant of the drive", min=0.01),
                effort_limits.EFFORT_RATE,
            )
        super().__init__(drive=drive)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        command = self._command(x, u, p)
        observed, estimated, built_up = x.observed_speed, x.disturbance_acceleration, x.built_up_brake
        applied = (self._effort(x, command) - built_up) / p.mass
        speed, disturbance = _observer_derivative(u.odometer, observed, estimated, applied, p.observer_bandwidth)
        relaxing = p.observer_bandwidth * (u.odometer - observed)  # the brake that holds a train is no disturbance
        asked = command.brake_demand * p.full_brake_force
        return {
            "observed_speed": either(command.standing, relaxing, speed),
            "disturbance_acceleration": either(command.standing, -p.observer_bandwidth * estimated, disturbance),
            "built_up_brake": _building_up(built_up, asked, p.brake_build_up_time, p.brake_release_time),
            **self._drive(x, command, p),
        }

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        command = self._command(x, u, p)
        resisting = -p.mass * x.disturbance_acceleration
        applied = {"effort": self._effort(x, command), "brake_demand": command.brake_demand}
        return {**applied, "disturbance_force": resisting}

    def _effort(self, x: Any, command: _Command) -> Array:
        return x.drive_effort if self._ramped else command.effort

    def _drive(self, x: Any, command: _Command, p: Any) -> dict[str, Array]:
        """Rate of the drive's effort [N/s], where it has one."""
        if not self._ramped:
            return {}
        wanted = (command.effort - x.drive_effort) / p.effort_lag
        return {"drive_effort": np.clip(wanted, -p.effort_rate, p.effort_rate)}

    @staticmethod
    def _command(x: Any, u: Any, p: Any) -> _Command:
        acceleration, air = u.acceleration_reference, holds(p.full_brake_force > 0.0)
        error, estimated = u.speed_reference - x.observed_speed, x.disturbance_acceleration
        wanted = _rejecting_force(error, acceleration, estimated, p.mass, p.control_bandwidth)
        brake_limit = effort_limits.electric_brake_limit(
            u.odometer, p.electric_brake_limit, p.electric_fade_start, p.electric_fade_end
        )
        effort = np.where(
            wanted < 0.0,
            effort_limits.electric_part(wanted, x.built_up_brake, brake_limit),
            np.minimum(wanted, effort_limits.traction_limit(u.odometer, p.effort_limit, p.power_limit)),
        )
        slow = holds(np.abs(u.odometer) < np.maximum(p.electric_fade_start, p.standstill_speed))
        service = np.maximum(holds(acceleration < -p.service_deceleration), slow)
        demand = either(service, effort_limits.air_brake_demand(wanted, p.full_brake_force, p.full_brake_force), 0.0)
        to_stand = every(holds(u.speed_reference <= 0.0), holds(acceleration <= 0.0))
        standing = every(to_stand, holds(np.abs(u.odometer) < p.standstill_speed))
        holding_effort = either(air, 0.0, -np.minimum(p.holding_effort, p.electric_brake_limit))
        return _Command(
            either(standing, holding_effort, effort),
            either(
                standing,
                effort_limits.air_brake_demand(-p.holding_effort, p.full_brake_force, p.full_brake_force),
                demand,
            ),
            standing,
        )


def _building_up(built_up: Array, asked: Array, build_up_time: Array, release_time: Array) -> Array:
    """Rate of the air brake's force [N/s], first order: quick when it builds up, slow when it is released."""
    return (asked - built_up) / np.where(asked > built_up, build_up_time, release_time)


def _observer_derivative(
    measured: Array, speed: Array, disturbance: Array, applied_acceleration: Array, bandwidth: Array
) -> tuple[Array, Array]:
    """Derivatives of both estimates: ``dz1 = z2 + b0 F + 2 wo (y - z1)``, ``dz2 = wo^2 (y - z1)``.

    Both poles of the estimation error lie at ``-wo`` (bandwidth parametrisation). `applied_acceleration` must come from
    the effort that is really applied, behind all limits: then a limit is no disturbance and nothing winds up.

    Source: Gao, Scaling and bandwidth-parameterization based controller tuning, American Control Conference 2003.
    """
    innovation = measured - speed
    return disturbance + applied_acceleration + 2.0 * bandwidth * innovation, bandwidth * bandwidth * innovation


def _rejecting_force(error: Array, acceleration: Array, disturbance: Array, mass: Array, bandwidth: Array) -> Array:
    """Force ``M (wc e + a_ref - z2)`` [N]: first order towards the reference, the disturbance taken out."""
    return mass * (bandwidth * error + acceleration - disturbance)
