"""The stopping controller: a constant-brake plan to a mark, tracked by PI with the disturbance compensated.

A sampled controller as a hybrid system of its own. It knows estimates by name only, and no observer; the plan comes
from its own file.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import Array, HybridSystem, PeriodicEvent
from plant_models.hybrid.signal import discrete_output, input_signal, memory, output_signal, parameter, warning_output
from plant_models.railway.control.logic import either, every, holds, some
from plant_models.railway.control.stopping_planner import NEVER, BrakePlan, constant_brake, reference_motion

ROLLS_AWAY = 10.0  # times the speed of standstill: a train that was held and runs so fast is planned for anew


class StoppingController(HybridSystem):
    """Stops a train at a mark: ``u = u* - (L1 (v - v_r) + L2 p_i + dhat) m / b`` with ``p_i' = v - v_r``.

    **Plan**: the constant brake u* that ends at `stop_position`, from the position and speed of the instant at which it
    is made (`stopping_planner`). It is made when `enabled` and moving, again when a detected fault is over, and
    whenever `plan_request` changes: connect what counts the balises that the observer has used. The reference
    ``v_r' = -w1 v_r + b u*`` is a closed form, so no step decides where it stops.

    **Tracking**: PI with the estimated disturbance compensated. The minus sign is the one of the closed loop (3.14),
    whose poles are -L1 .. as designed (-1 and -0.5 for the printed gains); with the plus sign of the printed (3.12)
    they are +1.61 and -0.31. What the limits cut off is not integrated.

    **Fault**: while `odometer_fault` is 1 the brake is to be released (`brake_released`), so that the wheels roll
    again; the effort goes on being commanded, and no plan is made before the recovery.

    **No braking solution**: where the drag alone stops the train short of the mark it rolls, and `no_braking_solution`
    is 1. Where the mark is too near for `effort_limit` the brake is planned at that limit, `limited_plan` is 1, and the
    train will pass the mark.

    At `standstill_speed` the train is held by `holding_effort`; where it rolls back all the same `rolls_back`
    is 1, and where it stands short of the mark by more than `stop_tolerance` `stands_short` is: with `traction_limit` =
    0 nothing pulls it on. The estimates come from an observer; for a comparison from the plant itself. `disturbance`
    acts forward; connect that of an observer whose disturbance resists with a factor of -1.

    Numbers are per unit mass with ``mass = 1``: newtons are then m/s2.

    Presets: `fault_tolerant` (default), `classical` (3.34): no compensation, no reaction to faults; `as_published`: the
    printed sign.

    Source: Aguiar Cota 2019, (3.4)-(3.14), (3.34), Algorithm 3-1, 3.2.2.4; limits, holding and the treatment of a plan
    that does not exist are ours.
    """

    name = "stopping_controller"
    description = "Fault-tolerant stop at a mark: constant-brake plan, PI tracking with compensation, brake release"
    source = "Aguiar Cota 2019, (3.4)-(3.14), (3.34), Algorithm 3-1"
    states = (
        memory("held_effort", "N", 0.0, "Effort of this period"),
        memory("integral", "m", 0.0, "Integral of the speed error, p_i"),
        memory("planned", "1", 0.0, "1 while there is a plan"),
        memory("plan_start", "s", 0.0, "Time at which the plan was made"),
        *(
            memory(f"plan_{what}", unit, 0.0, f"{what.capitalize()} at which the plan begins")
            for what, unit in (("speed", "m/s"), ("position", "m"))
        ),
        memory("plan_deceleration", "m/s2", 0.0, "Deceleration by the planned brake"),
        memory("plan_duration", "s", NEVER, "Time that the plan takes"),
        memory("drag_suffices", "1", 0.0, "1 where the drag alone stops the train short of the mark"),
        memory("limited", "1", 0.0, "1 where the mark is too near for the brake"),
        memory("standing", "1", 0.0, "1 while the train is held"),
        memory("fault_before", "1", 0.0, "Fault at the last instant"),
        memory("request_before", "1", 0.0, "Plan request at the last instant"),
        memory("plan_count", "1", 0.0, "Number of plans made"),
    )
    inputs = (
        input_signal("estimated_position", "m", 0.0, "Estimated position of the train"),
        input_signal("estimated_speed", "m/s", 0.0, "Estimated speed of the train", display_unit="km/h"),
        input_signal(
            "disturbance",
            "m/s2",
            0.0,
            "Estimated acceleration that the model does not know, forward > 0",
            optional=True,
        ),
        input_signal("odometer_fault", "1", 0.0, "1 while a jam is detected", optional=True),
        input_signal(
            "plan_request", "1", 0.0, "Whenever it changes the plan is renewed: a count of balises, say", optional=True
        ),
        input_signal(
            "enabled", "1", 1.0, "1 while the train is to be stopped; 0: no effort, and no plan", optional=True
        ),
    )
    outputs = (
        discrete_output("effort", "N", "Effort: traction > 0, brake < 0"),
        output_signal("speed_reference", "m/s", "Speed of the reference, now", display_unit="km/h"),
        output_signal("position_reference", "m", "Position of the reference, now"),
        discrete_output("planned_effort", "N", "Constant effort of the plan, u*"),
        discrete_output("brake_released", "1", "1 while the brake is to be released"),
        warning_output(
            "no_braking_solution",
            "1 where the drag alone stops the train short of the mark",
            "no brake leads to the mark: the drag alone stops the train short of it, so it rolls; enable the "
            "controller later",
            ("speed_reference", "remaining_distance"),
        ),
        warning_output(
            "limited_plan",
            "1 where the brake is too weak: the train will pass the mark",
            "the mark is too near for effort_limit, or behind: the train brakes with all there is and passes it; "
            "enable the controller sooner, or raise effort_limit",
            ("speed_reference", "remaining_distance"),
        ),
        warning_output(
            "stands_short",
            "1 where the train stands short of the mark by more than stop_tolerance",
            "the train stands short of the mark, and the controller may not pull it there: raise traction_limit "
            "where it is 0, or look for what braked it beyond the plan",
            ("remaining_distance",),
        ),
        warning_output(
            "rolls_back",
            "1 where the train rolls backwards although it is to stand",
            "the train rolls back from where it is to stand: holding_effort is too weak for the slope, or acts too "
            "late; raise it",
            ("effort", "remaining_distance"),
        ),
        discrete_output("plans", "1", "Number of plans made so far"),
        output_signal("remaining_distance", "m", "Way from the estimated position to the mark, now"),
    )
    parameters = (
        parameter("control_period", "s", 1e-3, "Control period", min=1e-5),
        parameter("stop_position", "m", 100.0, "The mark, p_f"),
        parameter("final_speed", "m/s", 0.0, "Speed at the mark, v_f", min=0.0, display_unit="km/h"),
        parameter("mass", "kg", 1.0, "Train mass; 1 for numbers per unit mass", min=1e-6),
        parameter("davis_b", "N.s/m", 0.1, "Running resistance of the reference, linear term", min=0.0),
        parameter("brake_coefficient", "1", 0.1, "Force per effort, b", min=1e-9),
        parameter("proportional_gain", "1/s", 1.4, "L1", min=0.0),
        parameter("integral_gain", "1/s2", 0.5, "L2", min=0.0),
        parameter("feedback_sign", "1", -1.0, "-1: the closed loop (3.14); +1: (3.12) as printed", min=-1.0, max=1.0),
        parameter("compensates", "1", 1.0, "1: the estimated disturbance is compensated", min=0.0, max=1.0),
        parameter("heeds_faults", "1", 1.0, "1: brake released in a fault, a new plan after it", min=0.0, max=1.0),
        parameter("replans_after_faults", "1", 1.0, "1: a new plan after a fault", min=0.0, max=1.0),
        parameter("effort_limit", "N", 100.0, "Largest brake effort", min=1e-9),
        parameter("traction_limit", "N", 0.0, "Largest traction effort", min=0.0),
        parameter("stop_tolerance", "m", 0.3, "Distance from the mark that counts as a stop at it", min=0.0),
        parameter("holding_effort", "N", 10.0, "Brake effort that holds the train at standstill", min=0.0),
        parameter("standstill_speed", "m/s", 0.01, "Speed at which the train is held", min=0.0, display_unit="km/h"),
    )
    events = (PeriodicEvent("control", "control_period", description="Plan and control law"),)
    presets = {
        "fault_tolerant": {},
        "classical": {"compensates": 0.0, "heeds_faults": 0.0},
        "as_published": {"feedback_sign": 1.0, "traction_limit": 100.0},
    }
    default_preset = "fault_tolerant"

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Plan where one is due, track it, hold at standstill: the memory for the coming period."""
        enabled = holds(u.enabled > 0.5)
        fault = every(holds(u.odometer_fault > 0.5), holds(p.heeds_faults > 0.5))
        limit = either(x.standing, ROLLS_AWAY * p.standstill_speed, p.standstill_speed)
        standing = every(enabled, holds(u.estimated_speed <= limit))
        recovered = every(x.fault_before, 1.0 - fault, holds(p.replans_after_faults > 0.5))
        asked = every(1.0 - fault, holds(u.plan_request != x.request_before))
        due = every(enabled, 1.0 - standing, some(1.0 - x.planned, recovered, asked))
        planned = _planned(x, due, recovered, t, u, p)
        x = x._replace(**planned)
        reference, _ = reference_motion(t - x.plan_start, x.plan_speed, x.plan_position, _plan(x), p.davis_b / p.mass)
        error = u.estimated_speed - reference
        integral = x.integral + p.control_period * error
        wanted = _feedforward(x, t, p) + p.feedback_sign * p.mass / p.brake_coefficient * (
            p.proportional_gain * error + p.integral_gain * integral + either(p.compensates, u.disturbance, 0.0)
        )
        effort = np.minimum(np.maximum(wanted, -p.effort_limit), p.traction_limit)
        winds_up = holds((wanted - effort) * p.feedback_sign * error > 0.0)
        integral = either(winds_up, x.integral, integral)
        effort = either(standing, -p.holding_effort, effort)
        return {
            **planned,
            "held_effort": either(enabled, effort, 0.0),
            "integral": either(every(enabled, 1.0 - standing), integral, 0.0),
            "planned": every(enabled, 1.0 - standing),
            "standing": standing,
            "fault_before": fault,
            "request_before": u.plan_request,
        }

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        speed, position = reference_motion(
            t - x.plan_start, x.plan_speed, x.plan_position, _plan(x), p.davis_b / p.mass
        )
        ever = holds(x.plan_count > 0.5)
        return {
            "effort": x.held_effort,
            "speed_reference": either(ever, speed, u.estimated_speed),
            "position_reference": either(ever, position, u.estimated_position),
            "planned_effort": -x.plan_deceleration * p.mass / p.brake_coefficient,
            "brake_released": every(x.fault_before, 1.0 - x.standing),
            "no_braking_solution": x.drag_suffices,
            "limited_plan": x.limited,
            "stands_short": every(x.standing, holds(p.stop_position - u.estimated_position > p.stop_tolerance)),
            "rolls_back": every(x.standing, holds(u.estimated_speed < -ROLLS_AWAY * p.standstill_speed)),
            "plans": x.plan_count,
            "remaining_distance": p.stop_position - u.estimated_position,
        }


def _plan(x: Any) -> BrakePlan:
    return BrakePlan(x.plan_deceleration, x.plan_duration, 1.0)


def _planned(x: Any, due: Array, recovered: Array, t: Array, u: Any, p: Any) -> dict[str, Array]:
    """What a new plan changes where one is due; after a fault the integral, which has summed the fault, restarts."""
    drag_rate = p.davis_b / p.mass
    distance = p.stop_position - u.estimated_position
    largest = p.effort_limit * p.brake_coefficient / p.mass
    wanted = constant_brake(u.estimated_speed, distance, drag_rate, p.final_speed)
    hardest = _hardest_brake(u.estimated_speed, largest, drag_rate, p.final_speed)
    faster = holds(u.estimated_speed > p.final_speed)
    behind = every(faster, holds(distance <= 0.0))
    limited = some(behind, every(wanted.possible, holds(wanted.deceleration > largest)))
    drag_suffices = every(faster, 1.0 - wanted.possible, 1.0 - behind)
    first = 1.0 - x.planned
    return {
        "integral": either(every(due, some(recovered, first)), 0.0, x.integral),
        "plan_start": either(due, t, x.plan_start),
        "plan_speed": either(due, u.estimated_speed, x.plan_speed),
        "plan_position": either(due, u.estimated_position, x.plan_position),
        "plan_deceleration": either(due, either(limited, largest, wanted.deceleration), x.plan_deceleration),
        "plan_duration": either(due, either(limited, hardest.duration, wanted.duration), x.plan_duration),
        "drag_suffices": either(due, drag_suffices, x.drag_suffices),
        "limited": either(due, limited, x.limited),
        "plan_count": x.plan_count + due,
    }


def _feedforward(x: Any, t: Array, p: Any) -> Array:
    """Effort of the plan [N]; after its end what keeps the final speed. A stop is braked for until the train stands."""
    over = every(holds(t - x.plan_start >= x.plan_duration), holds(p.final_speed > 0.0))
    return either(over, p.davis_b * p.final_speed, -x.plan_deceleration * p.mass) / p.brake_coefficient


def _hardest_brake(speed: Array, deceleration: Array, drag_rate: Array, final_speed: Array = 0.0) -> BrakePlan:
    """The plan of a given brake, wherever it ends: for a mark that is too near for the brake there is."""
    change = np.maximum(speed - final_speed, 0.0)
    x = drag_rate * change / (drag_rate * final_speed + deceleration)
    small = x < 1e-8
    per = np.where(small, 1.0 - 0.5 * x, np.log1p(x) / np.where(small, 1.0, x))
    return BrakePlan(deceleration, per * change / (drag_rate * final_speed + deceleration), 1.0)
