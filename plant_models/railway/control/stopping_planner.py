"""The constant brake that stops a train at a mark: its closed form, its duration, and the motion it makes.

Pure functions, traced like any equation, and one function in Python for who plans by hand. Knows only arrays.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from typing import NamedTuple

import numpy as np

from plant_models.hybrid import Array

NEWTON_STEPS = 7  # an eighth changes nothing but the last bit, for c from 1e-6 to 1 - 1e-9
SERIES_BELOW = 0.3
BERNOULLI = (1 / 12, -1 / 720, 1 / 30240, -1 / 1209600, 1 / 47900160, -691 / 1307674368000)
NEVER = 1e9  # [s]
SMALLEST = 1e-300


class BrakePlan(NamedTuple):
    """A constant brake: its deceleration ``-b u*`` [m/s2], its duration ``t_f - t_0`` [s], 1 where there is one."""

    deceleration: Array
    duration: Array
    possible: Array


class NoBrakingSolutionError(ValueError):
    """No constant brake ends at the mark: the drag alone stops the train short of it, or the mark is behind."""


@dataclass(frozen=True)
class _StoppingPlan:
    """A constant brake from a place and speed to a mark.

    Attributes:
        effort: u*, negative: it brakes [N, or m/s2 for a mass and coefficient of 1].
        duration: ``t_f - t_0`` [s].
        deceleration: ``-b u*`` [m/s2], the part of the deceleration that the brake makes.
        start_speed: v_0 [m/s]. start_position: p_0 [m]. drag_rate: w_1 [1/s].
    """

    effort: float
    duration: float
    deceleration: float
    start_speed: float
    start_position: float
    drag_rate: float

    def speed(self, time: Array) -> Array:
        """v_r [m/s], constant after the end.

        Args:
            time: since the start of the plan [s], any shape.

        Returns:
            Speeds of the same shape.
        """
        return reference_motion(time, self.start_speed, 0.0, self._plan(), self.drag_rate)[0]

    def position(self, time: Array) -> Array:
        """p_r [m].

        Args:
            time: since the start of the plan [s], any shape.

        Returns:
            Positions of the same shape.
        """
        return reference_motion(time, self.start_speed, self.start_position, self._plan(), self.drag_rate)[1]

    def _plan(self) -> BrakePlan:
        return BrakePlan(self.deceleration, self.duration, 1.0)


def plan_stop(
    speed: float,
    distance: float,
    *,
    drag_rate: float = 0.0,
    brake_coefficient: float = 1.0,
    mass: float = 1.0,
    final_speed: float = 0.0,
    position: float = 0.0,
) -> _StoppingPlan:
    """The constant brake that brings a train to a mark, ``v' = -w_1 v + b u* / m``.

    ``plan_stop(30.0, 100.0, drag_rate=0.1, brake_coefficient=0.1)`` is the thesis' example: u* = -26.2230, t_f = 7.6269
    s.

    Args:
        speed: v_0 now [m/s]. distance: ``p_f - p_0`` to the mark [m].
        drag_rate: w_1, linear drag per unit mass [1/s]. brake_coefficient: b, force per effort [1]. mass: m [kg].
        final_speed: v_f at the mark [m/s].
        position: p_0 now [m]; it shifts the positions of the plan, and nothing else.

    Returns:
        The plan.

    Raises:
        NoBrakingSolutionError: the drag alone slows the train down too early (``c <= 0``; the message says where), or
            the train is past the mark, or already slower than the final speed.
        ValueError: a number is not finite or has the wrong sign.

    Source: Aguiar Cota 2019, (3.4)-(3.11), signs repaired: the printed (3.5)-(3.11) take the magnitude of u*.
    """
    numbers = {
        "speed": speed,
        "distance": distance,
        "drag_rate": drag_rate,
        "brake_coefficient": brake_coefficient,
        "mass": mass,
        "final_speed": final_speed,
        "position": position,
    }
    _check_numbers(numbers)
    _check_braking(speed, distance, drag_rate, final_speed)
    plan = constant_brake(speed, distance, drag_rate, final_speed)
    deceleration = float(plan.deceleration)
    return _StoppingPlan(
        -deceleration * mass / brake_coefficient,
        float(plan.duration),
        deceleration,
        float(speed),
        float(position),
        float(drag_rate),
    )


def _check_numbers(numbers: Mapping[str, float]) -> None:
    """Refuse numbers of a plan that are not finite or have the wrong sign."""
    wrong = [f"{name} = {value!r}" for name, value in numbers.items() if not isfinite(value)]
    wrong += [f"{name} = {numbers[name]!r}" for name in ("drag_rate", "final_speed") if numbers[name] < 0.0]
    wrong += [f"{name} = {numbers[name]!r}" for name in ("brake_coefficient", "mass") if numbers[name] <= 0.0]
    if wrong:
        raise ValueError(
            f"Stopping plan: {', '.join(wrong)}; expected finite numbers, drag_rate and final_speed not negative, "
            f"brake_coefficient and mass positive."
        )


def _check_braking(speed: float, distance: float, drag_rate: float, final_speed: float) -> None:
    """Refuse a stop that no brake makes."""
    if distance <= 0.0:
        raise NoBrakingSolutionError(
            f"No braking solution: the mark is {-distance:g} m behind the train; plan earlier, or brake with all there "
            f"is."
        )
    if speed <= final_speed:
        raise NoBrakingSolutionError(
            f"No braking solution: the train runs at {speed:g} m/s and is to reach {final_speed:g} m/s; there is "
            f"nothing to brake."
        )
    if speed - final_speed <= drag_rate * distance:
        short = (speed - final_speed) / drag_rate
        what = "stops the train" if final_speed == 0.0 else f"slows the train down to {final_speed:g} m/s"
        raise NoBrakingSolutionError(
            f"No braking solution: the drag alone {what} after {short:g} m, {distance - short:g} m short of the mark "
            f"(c = 1 - drag_rate distance / (speed - final_speed) = "
            f"{1.0 - drag_rate * distance / (speed - final_speed):g}, must be positive); let it roll, and brake later."
        )


def constant_brake(speed: Array, distance: Array, drag_rate: Array, final_speed: Array = 0.0) -> BrakePlan:
    """The constant brake that makes `final_speed` at `distance`, for values of one common shape.

    With ``U = -u*``, ``k = w_1 (p_f - p_0) / (v_0 - v_f)`` and ``q = v_f / (v_0 - v_f)`` the unknown is
    ``w = w_1 (t_f - t_0)``: ``1 - w / (e^w - 1) + q w = k``; the duration is ``w / w_1``, and
    ``b U (t_f - t_0) = v_0 - v_f - w_1 (p_f - p_0)``. For a stop that is ``ln(1 + s) = c s`` with ``c = 1 - k`` and
    ``s = e^w - 1``, whose closed form is ``s = -W_{-1}(-c e^-c)/c - 1``. Newton's method starts from the bracket
    ``2 (1 - c)/c <= s`` and rises to the root, since the left side is concave. Nothing is divided by w_1: without drag
    the deceleration is ``(v_0^2 - v_f^2) / (2 (p_f - p_0))``.

    Where there is no such brake (see `plan_stop`), `possible` is 0, the deceleration 0 and the duration very long.

    Args:
        speed: v_0 [m/s]. distance: ``p_f - p_0`` [m]. drag_rate: w_1, not negative [1/s]. final_speed: v_f [m/s].

    Source: Aguiar Cota 2019, (3.8)-(3.10), Algorithm 3-1; start, series and the choice of w as unknown ours.
    """
    change = speed - final_speed
    rest = change - drag_rate * distance  # what the brake has to do
    possible = np.where(distance > 0.0, np.where(rest > 0.0, np.where(change > 0.0, 1.0, 0.0), 0.0), 0.0)
    legal = possible > 0.0
    change = np.where(legal, change, 1.0)
    way = np.where(legal, distance, 1.0)
    share = np.where(legal, drag_rate * way / change, 0.0)  # k
    left = np.where(legal, rest / change, 1.0)  # c = 1 - k, without cancellation where the caller has none
    ratio = np.where(legal, final_speed / change, 0.0)  # q
    w = _root(share, left, ratio)
    tiny = w < SMALLEST
    slowness = np.where(tiny, 1.0 / (0.5 + ratio), w / np.where(tiny, 1.0, share))  # w / k
    duration = slowness * way / change
    return BrakePlan(
        np.where(legal, left * change / duration, 0.0),
        np.where(legal, duration, NEVER),
        possible,
    )


def _root(share: Array, left: Array, ratio: Array) -> Array:
    """The w of ``1 - w/(e^w - 1) + q w = k``."""
    half = left + 2.0 * ratio
    # s / (2 + s) + q s = k has its root below that of the equation; for q = 0 it is 2 k / c
    w = np.log1p(4.0 * share / (half + np.sqrt(half * half + 8.0 * ratio * share)))
    for _ in range(NEWTON_STEPS):
        w = w - _newton_step(w, share, left, ratio)
    return w


def _newton_step(w: Array, share: Array, left: Array, ratio: Array) -> Array:
    """Newton's step for ``1 - w/(e^w - 1) + q w = k``, each side in the form that does not cancel."""
    series = w < SERIES_BELOW
    near, far = np.where(series, w, 0.0), np.where(series, 1.0, w)
    square = near * near
    tail: Array = 0.0
    for coefficient in reversed(BERNOULLI):
        tail = tail * square + coefficient
    bend = near * (0.5 - near * tail)  # 1 - w/(e^w - 1) near zero
    kept = far / np.expm1(far)
    value = np.where(series, bend - share, left - kept) + ratio * w
    bend = np.where(series, bend, 1.0 - kept)
    kept = np.where(series, 1.0 - bend, kept)
    moving = np.where(w < SMALLEST, 1.0, w)
    slope = np.where(w < SMALLEST, 0.5, kept * (moving - bend) / moving) + ratio
    return value / slope


def reference_motion(
    time: Array, speed: Array, position: Array, plan: BrakePlan, drag_rate: Array
) -> tuple[Array, Array]:
    """Speed [m/s] and position [m] of the reference model ``v_r' = -w_1 v_r + b u*``, ``p_r' = v_r``.

    After the end of the plan the speed stays what it is there.

    Args:
        time: since the begin of the plan [s]. speed: v_0 [m/s]. position: p_0 [m]. plan: the brake. drag_rate: w_1
            [1/s].

    Source: Aguiar Cota 2019, (3.4)-(3.6), in closed form: no step decides where the reference stops.
    """
    passed = np.minimum(np.maximum(time, 0.0), plan.duration)
    x = drag_rate * passed
    near = x < 1e-2
    there = np.where(near, 1.0, x)
    first = np.where(near, 1.0 - x / 2.0 + x * x / 6.0 - x * x * x / 24.0 + x**4 / 120.0, -np.expm1(-there) / there)
    second = np.where(near, 0.5 - x / 6.0 + x * x / 24.0 - x * x * x / 120.0 + x**4 / 720.0, (1.0 - first) / there)
    reached = speed * np.exp(-x) - plan.deceleration * passed * first
    way = speed * passed * first - plan.deceleration * passed * passed * second
    return reached, position + way + (np.maximum(time, 0.0) - passed) * reached


def tracking_poles(
    proportional_gain: float, integral_gain: float, drag_rate: float = 0.0, feedback_sign: float = -1.0
) -> np.ndarray:
    """Poles [1/s] of the speed error under PI tracking, ``[e; p_i]' = [[-w_1 - L_1, -L_2], [1, 0]] [e; p_i]``.

    Args:
        proportional_gain: L_1 [1/s]. integral_gain: L_2 [1/s2]. drag_rate: w_1 [1/s].
        feedback_sign: -1 as in the closed loop (3.14), +1 as (3.12) is printed, which is unstable.

    Returns:
        Both poles, complex, shape (2,), the faster one first.
    """
    feedback = -feedback_sign
    loop = [[-drag_rate - feedback * proportional_gain, -feedback * integral_gain], [1.0, 0.0]]
    return np.sort_complex(np.linalg.eigvals(np.array(loop)).astype(complex))
