"""The MDPE controller: the observer-based control of the train, one regulator for each mode and adhesion level.

A sampled controller as a hybrid system of its own. It knows estimates by name only, and no observer; regulator, switch,
limits, blending and coupler protection come from their own files.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from plant_models.hybrid import Array, HybridSystem, PeriodicEvent
from plant_models.hybrid.signal import discrete_output, input_signal, memory, output_signal, parameter
from plant_models.railway.control import effort_limits
from plant_models.railway.control.logic import either, every, holds, some
from plant_models.railway.control.mode_switch import (
    COMBINED,
    ELECTRIC,
    INDIRECT,
    NOMINAL,
    TRACTION,
    Situation,
    next_level,
)
from plant_models.railway.control.sampled_regulator import RegulatorGains, pole_placement


class _Limits(NamedTuple):
    """Limits of this instant [N], all but the signs positive: traction, electric brake, and the steps of the effort."""

    traction: Array
    electric: Array
    down: Array
    up: Array


class _Regulated(NamedTuple):
    """Force behind its limits [N] and the integral for the next instant [N]."""

    target: Array
    integral: Array


class MdpeController(HybridSystem):
    """Speed control with eight regulators, a switch, and limits that follow the estimated adhesion and the coupler.

    Every `control_period`: ``F = M a_ref + M g slope + d_hat + Kp e + I`` with ``e = v_ref - speed``, limited, and
    shared between the electric drive and the air brake.

    - **Regulators**: PI, one for each mode (traction, electric, indirect, combined brake) and adhesion level (nominal,
      degraded). Both poles of the train's mass under a regulator lie at ``exp(-omega T)``, with ``omega`` from
      `bandwidth_nominal` or `bandwidth_degraded`. The active one gives back what its limits cut off (anti-windup). The
      inactive ones hold the integral with which they would have asked for the force of this instant, so a change of
      mode or level makes no jump.
    - **Switch**: mode by sign of the force, tracking error, reference, speed, coupler force and adhesion level, with
      hysteresis (`next_mode`). Degraded adhesion counts at once, nominal after `recovery_time`.
    - **Pre-saturation**: the electric effort stays within effort limit, power limit and the available adhesion. That is
      cut to `adhesion_margin` of the estimated adhesion force while ``|slip| > slip_limit``, and to the force itself
      when the adhesion becomes degraded; then it rises by `recovery_nominal` or `recovery_degraded` a second.
    - **Coupler protection**: the effort moves by `effort_rate` at most, less as the coupler is loaded beyond its soft
      limit, and back beyond its limit. Only the cut in slip, and the limits of effort and power, are quicker.
    - **Blending**: in brake the electric effort is what air has not built up yet. In the combined mode both share by
      capacity.
    - **Sand** is requested where slip is beyond its limit and the train is off its reference by more than
      `sanding_error`:
      when the estimated adhesion alone does not do.

    The estimates must not hold one thing twice: with a `disturbance_force` that contains the gradient (the augmented
    observers'), leave `slope` unconnected. Unconnected estimates are harmless (no slip, nominal, no coupler force).

    Numbers: none are printed; all are ours. Bandwidths: where the drive acts, a decade below the slowest coupler mode
    (0.822 Hz),
    0.5 rad/s; where air alone acts, well below the reciprocal of its build-up time, 0.2 rad/s; combined, their
    geometric mean; degraded, half. `effort_rate`: the nominal start, 0.5 m/s2 of 166 t = 83 kN, in one period of the
    slowest coupler mode.
    `slip_limit`: the smallest optimal slip of degraded adhesion in Table 4.5 (7.2 % at 50 km/h). Coupler: 150 and 250
    kN, far below the 850 kN at which a standard screw coupling may break. Electric brake: 150 kN, usual for freight
    trains.

    Presets: `train` (default; 166 t with air brake), `single_mass` (90 t without air brake: the plant `locomotive`).

    Source: Bouchama 2024, section 4.5, Table 4.3, figure 4.16 (the parts), section 4.1 (350 kN, 4.2 MW); laws and
    numbers ours.
    """

    name = "mdpe_controller"
    description = (
        "Observer-based train control: regulators by mode and adhesion, limits by estimated adhesion and coupler force"
    )
    source = "Bouchama 2024, section 4.5 and Table 4.3; gains and thresholds ours"
    internal_step = 1e-2  # nothing flows
    states = (
        memory("held_effort", "N", 0.0, "Effort of this period"),
        memory("held_demand", "1", 0.0, "Demand to the air brake of this period"),
        memory("integral", "N", 0.0, "Integral of the active regulator"),
        memory("last_error", "m/s", 0.0, "Tracking error at the last instant"),
        memory("last_feedforward", "N", 0.0, "Feedforward at the last instant"),
        memory("target_force", "N", 0.0, "Force behind the limits, before blending and rates"),
        memory("held_mode", "1", TRACTION, "Mode"),
        memory("held_level", "1", NOMINAL, "Adhesion level"),
        memory("quiet_time", "s", 0.0, "Time for which the adhesion has been reported nominal"),
        memory("available_effort", "N", 350e3, "Effort that the rail is believed to bear"),
        memory("built_up_brake", "N", 0.0, "Force that the air brake is believed to have built up"),
        memory("sanding", "1", 0.0, "1 while sand is requested"),
    )
    inputs = (
        effort_limits.ODOMETER,
        input_signal("speed", "m/s", 0.0, "Estimated speed of the train", display_unit="km/h"),
        input_signal("adhesion_force", "N", 0.0, "Estimated adhesion force of the locomotive"),
        input_signal("slip", "1", 0.0, "Estimated slip ratio"),
        input_signal("adhesion_condition", "1", 1.0, "Adhesion as detected: 1 nominal, 2 degraded"),
        input_signal("coupler_force", "N", 0.0, "Estimated force in the first coupler, tension > 0"),
        input_signal(
            "disturbance_force", "N", 0.0, "Estimated force that resists beyond mass times acceleration", optional=True
        ),
        input_signal(
            "slope", "1", 0.0, "Gradient of the track from the track data, uphill > 0; sine of the angle", optional=True
        ),
        *effort_limits.FOLLOWED,
    )
    outputs = (
        discrete_output("effort", "N", "Effort of the locomotive's drive: traction > 0, electric brake < 0"),
        discrete_output("brake_demand", "1", "Demand to the air brake, 0..1"),
        discrete_output("mode", "1", "1 traction, 2 electric, 3 indirect, 4 combined brake"),
        discrete_output("adhesion_level", "1", "Adhesion that counts: 1 nominal, 2 degraded"),
        discrete_output("sanding_request", "1", "1 while sand is requested"),
        discrete_output("effort_available", "N", "Effort that the rail is believed to bear"),
        output_signal("speed_error", "m/s", "Reference minus estimated speed, now", display_unit="km/h"),
        output_signal("drive_power", "W", "Power of the drive at the wheels, now; braking < 0"),
    )
    parameters = (
        parameter("control_period", "s", 0.1, "Control period T", min=1e-3),
        effort_limits.TRAIN_MASS,
        parameter("gravity", "m/s2", 9.81, "Acceleration of gravity g", min=0.0),
        parameter(
            "bandwidth_nominal",
            "rad/s",
            (0.5, 0.5, 0.2, 0.32),
            "Bandwidth of the regulators, nominal",
            min=1e-3,
            size=4,
        ),
        parameter(
            "bandwidth_degraded", "rad/s", (0.25, 0.25, 0.1, 0.16), "Bandwidth, degraded adhesion", min=1e-3, size=4
        ),
        *effort_limits.DRIVE_AND_BRAKES,
        parameter(
            "adhesion_margin", "1", 0.85, "Share of the estimated adhesion force that is used in slip", min=0.0, max=1.0
        ),
        parameter("slip_limit", "1", 0.072, "Slip beyond which the effort is cut", min=0.0),
        parameter(
            "slip_min_speed",
            "m/s",
            1.0,
            "Slip counts only where wheel or train move faster",
            min=0.0,
            display_unit="km/h",
        ),
        parameter("smallest_effort", "N", 10e3, "Effort to which adhesion may cut at most", min=0.0),
        parameter("recovery_nominal", "N/s", 50e3, "Rise of the available effort, nominal adhesion", min=0.0),
        parameter("recovery_degraded", "N/s", 5e3, "Rise of the available effort, degraded adhesion", min=0.0),
        parameter("recovery_time", "s", 5.0, "Time of nominal reports until the adhesion counts as nominal", min=0.0),
        effort_limits.EFFORT_RATE,
        parameter("coupler_soft_limit", "N", 150e3, "Coupler force from which the rate is reduced", min=0.0),
        parameter("coupler_limit", "N", 250e3, "Coupler force that the effort must not exceed", min=1.0),
        parameter("acceleration_band", "m/s2", 0.05, "Reference acceleration that counts as none", min=0.0),
        parameter("error_band", "m/s", 0.1, "Error within which the train coasts", min=0.0, display_unit="km/h"),
        effort_limits.SERVICE_DECELERATION,
        parameter(
            "combined_error", "m/s", 0.5, "Excess speed from which both brakes act", min=0.0, display_unit="km/h"
        ),
        parameter(
            "sanding_error", "m/s", 2.0, "Tracking error in slip from which sand is used", min=0.0, display_unit="km/h"
        ),
        effort_limits.HOLDING_EFFORT,
        parameter("standstill_speed", "m/s", 0.1, "Speed below which the train stands", min=0.0, display_unit="km/h"),
    )
    events = (PeriodicEvent("control", "control_period", description="Decision and control law"),)
    presets = effort_limits.PRESETS
    default_preset = "train"

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Decide, regulate, limit, share: the memory for the coming period."""
        error = u.speed_reference - u.speed
        feedforward = p.mass * (u.acceleration_reference + p.gravity * u.slope) + u.disturbance_force
        standing = _standing(u, p)
        sliding = _sliding(u, p)
        level, quiet = next_level(x.held_level, x.quiet_time, u.adhesion_condition, p.control_period, p.recovery_time)
        available = _available(x, u, p, level, sliding)
        wanted = _gains(x.held_mode, x.held_level, p).force(x.integral, feedforward, error)
        mode = _situation(x, u, level, wanted, error, standing).next_mode(p)
        limits = _limits(x, u, p, available)
        regulated = _regulate(x, mode, level, error, feedforward, limits, p)
        target = either(standing, 0.0, regulated.target)
        effort, demand = _share(x, mode, target, standing, limits, p)
        asked = demand * p.full_brake_force
        built_up = _built_up_after(
            x.built_up_brake, asked, p.control_period, p.brake_build_up_time, p.brake_release_time
        )
        sanding = every(sliding, holds(np.abs(error) > p.sanding_error))
        return {
            "held_effort": effort,
            "held_demand": demand,
            "integral": either(standing, 0.0, regulated.integral),
            "last_error": error,
            "last_feedforward": feedforward,
            "target_force": target,
            "held_mode": mode,
            "held_level": level,
            "quiet_time": quiet,
            "available_effort": available,
            "built_up_brake": built_up,
            "sanding": sanding,
        }

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {
            "effort": x.held_effort,
            "brake_demand": x.held_demand,
            "mode": x.held_mode,
            "adhesion_level": x.held_level,
            "sanding_request": x.sanding,
            "effort_available": x.available_effort,
            "speed_error": u.speed_reference - u.speed,
            "drive_power": x.held_effort * u.odometer,
        }


def _situation(x: Any, u: Any, level: Array, wanted: Array, error: Array, standing: Array) -> Situation:
    """What the mode is chosen from."""
    slower = np.minimum(np.abs(u.speed), np.abs(u.odometer))  # a locked wheel has no electric brake
    return Situation(x.held_mode, level, wanted, error, u.acceleration_reference, slower, u.coupler_force, standing)


def _standing(u: Any, p: Any) -> Array:
    """1 where the train is to stand and does, by estimate and odometer: a locked wheel is no standing train."""
    fastest = np.maximum(np.abs(u.speed), np.abs(u.odometer))
    to_stand = every(holds(u.speed_reference <= 0.0), holds(u.acceleration_reference <= 0.0))
    return every(to_stand, holds(fastest < p.standstill_speed))


def _sliding(u: Any, p: Any) -> Array:
    """1 where the slip is beyond its limit and wheel or train move: near standstill a slip ratio says nothing."""
    fastest = np.maximum(np.abs(u.speed), np.abs(u.odometer))
    return every(holds(np.abs(u.slip) > p.slip_limit), holds(fastest > p.slip_min_speed))


def _available(x: Any, u: Any, p: Any, level: Array, sliding: Array) -> Array:
    degraded = holds(level > 1.5)
    recovery = p.control_period * either(degraded, p.recovery_degraded, p.recovery_nominal)
    return _next_available_effort(
        x.available_effort,
        u.adhesion_force,
        sliding,
        every(degraded, holds(x.held_level < 1.5)),
        recovery,
        margin=p.adhesion_margin,
        floor=p.smallest_effort,
        limit=np.maximum(p.effort_limit, p.electric_brake_limit),
    )


def _limits(x: Any, u: Any, p: Any, available: Array) -> _Limits:
    electric = effort_limits.electric_brake_limit(
        u.odometer, p.electric_brake_limit, p.electric_fade_start, p.electric_fade_end
    )
    largest = p.effort_rate * p.control_period
    down, up = _effort_steps(x.held_effort, u.coupler_force, largest, p.coupler_soft_limit, p.coupler_limit)
    return _Limits(
        np.minimum(effort_limits.traction_limit(u.odometer, p.effort_limit, p.power_limit), available),
        np.minimum(electric, available),
        down,
        up,
    )


def _gains(mode: Array, level: Array, p: Any) -> RegulatorGains:
    chosen = [either(holds(level > 1.5), p.bandwidth_degraded[i], p.bandwidth_nominal[i]) for i in range(4)]
    bandwidth = chosen[0]
    for number, candidate in zip((ELECTRIC, INDIRECT, COMBINED), chosen[1:], strict=True):
        bandwidth = np.where(mode == number, candidate, bandwidth)
    return pole_placement(bandwidth, p.mass, p.control_period)


def _regulate(
    x: Any, mode: Array, level: Array, error: Array, feedforward: Array, limits: _Limits, p: Any
) -> _Regulated:
    gains = _gains(mode, level, p)
    changed = some(holds(mode != x.held_mode), holds(level != x.held_level))
    # The new regulator starts from the force of the last instant; a step of the feedforward since then is kept.
    integral = either(changed, gains.holding(x.target_force, x.last_feedforward, x.last_error), x.integral)
    wanted = gains.force(integral, feedforward, error)
    lowest, highest = _range(x, mode, limits, p)
    target = np.minimum(np.maximum(wanted, lowest), highest)
    return _Regulated(target, gains.next_integral(integral, error, target - wanted))


def _range(x: Any, mode: Array, limits: _Limits, p: Any) -> tuple[Array, Array]:
    """Smallest and largest force of a mode [N]. A loaded coupler counts as a limit, else the integral would wind up."""
    unloaded = p.effort_rate * p.control_period
    more = np.where(limits.up < unloaded, np.maximum(x.held_effort + limits.up, 0.0), limits.traction)
    less = np.where(limits.down < unloaded, np.maximum(limits.down - x.held_effort, 0.0), limits.electric)
    traction, electric = np.minimum(limits.traction, more), np.minimum(limits.electric, less)
    brake = np.where(
        mode == ELECTRIC, electric, np.where(mode == INDIRECT, p.full_brake_force, p.full_brake_force + electric)
    )
    driving = holds(mode == TRACTION)
    return either(driving, 0.0, -brake), either(driving, traction, 0.0)


def _share(x: Any, mode: Array, target: Array, standing: Array, limits: _Limits, p: Any) -> tuple[Array, Array]:
    """Effort [N] and demand to the air brake [1] for a target force."""
    capacity = p.full_brake_force + np.where(mode == COMBINED, limits.electric, 0.0)
    braked = either(standing, -p.holding_effort, target)
    demand = either(holds(mode > 2.5), effort_limits.air_brake_demand(braked, capacity, p.full_brake_force), 0.0)
    wanted = either(
        holds(mode == TRACTION), target, effort_limits.electric_part(braked, x.built_up_brake, limits.electric)
    )
    effort = _stepped_towards(x.held_effort, wanted, limits.down, limits.up)
    return np.minimum(np.maximum(effort, -limits.electric), limits.traction), demand


def _coupler_headroom(load: Array, soft_limit: Array, limit: Array) -> Array:
    """Share of the effort's rate that may load the coupler further [1]: 1 up to the soft limit, 0 at the limit, then
    negative.

    Beyond the limit the sign is that of a forced step back, -1 at and beyond ``2 limit - soft_limit``.
    """
    return np.clip((limit - load) / np.maximum(limit - soft_limit, 1.0), -1.0, 1.0)


def _effort_steps(
    effort: Array, coupler_force: Array, largest_step: Array, soft_limit: Array, limit: Array
) -> tuple[Array, Array]:
    """Largest steps down and up of the effort in one period [N]; a negative one is a step the other way that must be
    made.

    More traction (or less brake) pulls at the coupler, less traction (or more brake) pushes into it. Traction and brake
    may always go back to zero at the full rate: else a pressed coupler would keep the traction on under a brake. And
    what must be made goes to zero at most: a tension that others cause is no reason to brake the locomotive.
    """
    down = largest_step * _coupler_headroom(-coupler_force, soft_limit, limit)
    up = largest_step * _coupler_headroom(coupler_force, soft_limit, limit)
    return np.maximum(down, np.minimum(effort, largest_step)), np.maximum(up, np.minimum(-effort, largest_step))


def _next_available_effort(
    available: Array,
    adhesion_force: Array,
    sliding: Array,
    newly_degraded: Array,
    recovery: Array,
    *,
    margin: Array,
    floor: Array,
    limit: Array,
) -> Array:
    """Available effort [N] after one period.

    A wheel that slides turns with ``J dw = r (F - F_ad)``: only an effort below the adhesion force of this moment
    brings it back. So in slip the available effort falls to `margin` times that force at once. Where the adhesion has
    just been judged degraded, without slip beyond the limit, it falls to the force itself. Otherwise it rises by
    `recovery`.
    """
    transmitted = np.abs(adhesion_force) * either(sliding, margin, 1.0)
    cut = np.minimum(available, np.maximum(transmitted, floor))
    return either(some(sliding, newly_degraded), cut, np.minimum(available + recovery, limit))


def _built_up_after(built_up: Array, asked: Array, period: Array, build_up_time: Array, release_time: Array) -> Array:
    """Force [N] to which `building_up` leads within a period [s] of constant demand, exactly."""
    time = np.where(asked > built_up, build_up_time, release_time)
    return asked + np.exp(-period / time) * (built_up - asked)


def _stepped_towards(previous: Array, wanted: Array, down: Array, up: Array) -> Array:
    """`wanted`, or as near to it as a step of at most `down` below and `up` above `previous` comes, any one unit.

    A negative `up` (or `down`) demands a step of at least that size the other way.
    """
    return previous + np.minimum(np.maximum(wanted - previous, -down), up)
