"""Integration: one internal step of a hybrid system, written in the same plain NumPy as the system.

`rk4` for smooth equations, `rosenbrock` (linearly implicit, L-stable) for stiff ones, `euler` for discontinuous ones of
sampled signals (a sliding-mode differentiator), which ask for one evaluation a step; dry friction is set-valued and
resolved inside the step, and all stages of a step see the switches as they are at its start. The functions trace like
the system does; they know nothing of events or of who calls them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import sqrt
from typing import NamedTuple

import numpy as np

from plant_models.hybrid.arrays import Array
from plant_models.hybrid.system import HybridSystem

Derivative = Callable[[Array, Array], Array]  # (t, x) -> derivative of the continuous states
Jacobian = Callable[[Array, Array], tuple[Array, Array]]  # (t, x) -> (d/dx of shape (nc, nc), d/dt of shape (nc,))


class _Linearised(NamedTuple):
    """Derivatives of the flow: by all states, shape (nc, nc); by those treated implicitly; by time, shape (nc,); and 1
    for these states.
    """

    by_all: Array
    by_state: Array
    by_time: Array
    implicit: Array


ROSENBROCK_GAMMA = 1.0 - 1.0 / sqrt(2.0)

BEND_STEEPNESS = 3.0
"""How much steeper than the secant over it a bend is taken to be. With 1 a wheel may jump to and fro across the creep
curve's rise; with 2 and with 3 no start was found from which it does (`test_sliding_wheel`)."""

HOLD_TOLERANCE = 1e-12
"""Share of a dry friction by which a push may exceed it and not move what is at rest: such an excess is rounding."""


def effective_flow(
    system: HybridSystem, t: Array, x: Array, u: Array, p: Array, sign: Array | None, switches: Array | None = None
) -> Array:
    """Derivative with dry friction resolved for one direction of motion.

    A state that moves (sign +1 or -1) feels the full friction against its motion. A state at rest (sign 0) feels just
    the friction that holds it, up to the full one: the set-valued Coulomb law.

    Args:
        x: state, shape (n,). u: inputs, shape (m,). p: parameters, shape (k,).
        sign: signs of the states with friction at the start of the step, shape (nf,), or None without friction.
        switches: of the system at the start of the step, shape (ns,); None for those that hold now.

    Returns:
        Derivatives of the continuous states, shape (nc,).
    """
    derivative = system.state_derivative(t, x, u, p, switches)
    if sign is None:
        return derivative
    friction = system.friction_vector(t, x, u, p, switches)
    parts = [derivative[i] for i in range(system.continuous_count)]
    for j, i in enumerate(system.friction_indices()):
        pushed = np.abs(parts[i]) >= friction[j] * (1.0 + HOLD_TOLERANCE)  # a friction of zero holds nothing
        free = np.where(pushed, parts[i] - np.clip(parts[i], -friction[j], friction[j]), 0.0)
        parts[i] = np.where(sign[j] == 0.0, free, parts[i] - sign[j] * friction[j])
    return _stack(parts)


def step(
    system: HybridSystem, t: Array, h: Array, x: Array, u: Array, p: Array, jacobian: Jacobian | None = None
) -> Array:
    """State after one internal step by the system's own method.

    Args:
        t: time at the start [s]. h: step [s]. x: state, shape (n,). u: inputs held over the step, shape (m,). p: shape
            (k,).
        jacobian: exact derivatives of `effective_flow`, needed by ``rosenbrock``; see `tracing`.

    Returns:
        State at ``t + h``, shape (n,); memory is unchanged.

    Raises:
        ValueError: the method needs a Jacobian and none is given, or is unknown.
    """
    count = system.continuous_count
    if count == 0:
        return x
    sign = _friction_sign(system, x)
    switches = system.switch_vector(t, x, u, p)

    def derivative(time: Array, continuous: Array) -> Array:
        whole = continuous
        if system.state_count > count:
            whole = _before_memory([continuous[i] for i in range(count)], x, system)
        return effective_flow(system, time, whole, u, p, sign, switches)

    if system.method in EXPLICIT:
        moved = EXPLICIT[system.method](derivative, t, h, x[:count])
    else:
        at_rest = _at_rest(system, t, x, u, p, sign)
        moved = _rosenbrock_step(derivative, _stated(jacobian, system), t, h, x[:count], at_rest, system.stiff_mask())
    return _before_memory(_stopped(system, moved, sign), x, system)


def rk4_step(derivative: Derivative, t: Array, h: Array, x: Array) -> Array:
    """The classical Runge-Kutta step of order 4.

    Args:
        derivative: of time [s] and state. t: start of the step [s]. h: its length [s].
        x: state at `t`, shape (n,) or (n, members).
    """
    k1 = derivative(t, x)
    k2 = derivative(t + 0.5 * h, x + 0.5 * h * k1)
    k3 = derivative(t + 0.5 * h, x + 0.5 * h * k2)
    k4 = derivative(t + h, x + h * k3)
    return x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


def _euler_step(derivative: Derivative, t: Array, h: Array, x: Array) -> Array:
    return x + h * derivative(t, x)


EXPLICIT: Mapping[str, Callable[[Derivative, Array, Array, Array], Array]] = {"rk4": rk4_step, "euler": _euler_step}
"""Steps that need no Jacobian, by the name of the method."""


def _rosenbrock_step(
    derivative: Derivative,
    jacobian: Jacobian,
    t: Array,
    h: Array,
    x: Array,
    at_rest: Array | None = None,
    stiff: np.ndarray | None = None,
) -> Array:
    """The two-stage Rosenbrock step ROS2 of order 2, L-stable with gamma = 1 - 1/sqrt(2), guarded against steep bends.

    ``(I - g h J) k1 = f(t, x) + g h f_t``, ``(I - g h J) k2 = f(t+h, x + h k1) - 2 k1 - g h f_t``,
    ``x+ = x + h (3 k1 + k2) / 2`` (Verwer, Spee, Blom, Hundsdorfer, SIAM J. Sci. Comput. 20 (1999) 1456-1480). Linear
    systems, no iteration: the cost is fixed and the step can be generated as straight-line C. The order is 2 with any
    matrix in place of the Jacobian, so that it may be kept to the states that are stiff.
    """
    J = _linearised(jacobian, t, x, stiff)
    flow = derivative(t, x)
    held, fixed = _held(J, flow, at_rest)
    k1, ahead, k2 = _stages(derivative, J, fixed, t, h, x, flow)
    smooth = x + 0.5 * h * (3.0 * k1 + k2)
    bent, missing = _bend(J, h, k1, flow, ahead, stiff is None)
    if at_rest is None:
        return np.where(bent < 0.0, _damped_step(J.by_state, h * k1 * J.implicit, missing, h, x, flow), smooth)
    damped = _damped_step(J.by_state, h * k1 * J.implicit, np.where(held > 0.0, 0.0, missing), h, x, flow)
    damped = np.where(fixed > 0.0, x, damped)
    return np.where(bent - _let_go_too_soon(derivative, held, ahead, t + h, damped) < 0.0, damped, smooth)


def _linearised(jacobian: Jacobian, t: Array, x: Array, stiff: np.ndarray | None) -> _Linearised:
    by_all, by_time = jacobian(t, x)
    if stiff is None:
        return _Linearised(by_all, by_all, by_time, 1.0)
    return _Linearised(by_all, by_all * np.outer(stiff, stiff), by_time, stiff)


def _held(J: _Linearised, flow: Array, at_rest: Array | None) -> tuple[Array, Array]:
    """1 for states that dry friction holds at the start, else 0; the same for those that nothing moves."""
    held = 0.0 * flow if at_rest is None else np.where(flow == 0.0, at_rest, 0.0)
    # A held state whose row of the Jacobian is zero does not move at all; the solution of a larger system would add its
    # rounding.
    return held, np.where(np.abs(J.by_all) @ np.ones(flow.shape[0]) == 0.0, held, 0.0)


def _stages(
    derivative: Derivative, J: _Linearised, fixed: Array, t: Array, h: Array, x: Array, flow: Array
) -> tuple[Array, Array, Array]:
    """Both stages, and between them the derivative that the first one leads to: ``(k1, f(t + h, x + h k1), k2)``."""
    gamma_h = ROSENBROCK_GAMMA * h
    matrix = np.eye(x.shape[0]) - gamma_h * J.by_state
    k1 = np.where(fixed > 0.0, 0.0, np.linalg.solve(matrix, flow + gamma_h * J.by_time))
    ahead = derivative(t + h, x + h * k1)
    k2 = np.linalg.solve(matrix, ahead - 2.0 * k1 - gamma_h * J.by_time)
    return k1, ahead, np.where(ahead == 0.0, np.where(fixed > 0.0, 0.0, k2), k2)


def _let_go_too_soon(derivative: Derivative, held: Array, ahead: Array, end: Array, damped: Array) -> Array:
    """1 where the first stage lets go a state that is still held where `_damped_step` ends, else 0.

    The stages shoot past the value a stiff state settles at, by 2.4 times the way there and, at the end of the step, by
    up to a sixth of it. Where such a state pushes another one that dry friction holds, the excess would set it in
    motion although the push itself can not. So where a stage lets go a state that is held at the start of the step,
    `_damped_step`, which does not shoot past, decides.
    """
    let_go = np.where(np.sum(held * np.abs(ahead)) > 0.0, 1.0, 0.0)
    still_held = np.where(np.sum(held * np.abs(derivative(end, damped))) > 0.0, 0.0, 1.0)
    return let_go * still_held


def _bend(J: _Linearised, h: Array, k1: Array, flow: Array, ahead: Array, all_implicit: bool) -> tuple[Array, Array]:
    """Negative where the first stage has turned a derivative round, by more than the Jacobian predicted; and the change
    that the Jacobian does not explain then, shape (nc,).

    The Jacobian knows the slope here and nothing of a steep part that the stage leaps over, such as the rise of a creep
    curve between two flat branches. There the two stages may cancel, and a sliding wheel would slide for ever: so
    `_damped_step` takes their place.
    """
    change, predicted = ahead - flow, h * (J.by_all @ k1 + J.by_time)
    turned = J.implicit * np.where(change * k1 < 0.0, np.minimum(flow * ahead, 0.0), 0.0)
    bent = np.sum(np.where(np.abs(change - predicted) > np.abs(flow), turned, 0.0))
    known = predicted if all_implicit else h * (J.by_state @ k1 + J.by_time)
    return bent, J.implicit * np.where(bent < 0.0, BEND_STEEPNESS * change - known, 0.0)


def _damped_step(by_state: Array, move: Array, missing: Array, h: Array, x: Array, flow: Array) -> Array:
    """The linearly implicit Euler step with a Jacobian that explains `missing` more change over `move`, by Broyden's
    update; the plain one where nothing is missing.

    The update adds a multiple of `missing` in every column, so that what the flow conserves, momentum above all, stays
    conserved.

    Args:
        by_state: Jacobian of the flow, shape (n, n).
        h: length of the step [s].
        x: state at its start, shape (n,). flow: derivative there, shape (n,).
    """
    length = move @ move
    steeper = by_state + np.outer(missing, move) / np.where(length == 0.0, 1.0, length)
    return x + np.linalg.solve(np.eye(x.shape[0]) - h * steeper, h * flow)


def _friction_sign(system: HybridSystem, x: Array) -> Array | None:
    indices = system.friction_indices()
    return _stack([np.sign(x[i]) for i in indices]) if indices else None


def _stated(jacobian: Jacobian | None, system: HybridSystem) -> Jacobian:
    """The Jacobian that ``rosenbrock`` needs, the one method besides the explicit ones."""
    if system.method != "rosenbrock":
        raise ValueError(f"{system.name}: unknown method {system.method!r}; use 'rk4', 'rosenbrock' or 'euler'.")
    if jacobian is None:
        raise ValueError(f"{system.name}: the rosenbrock step needs the Jacobian of the flow.")
    return jacobian


def _stopped(system: HybridSystem, moved: Array, sign: Array | None) -> list[Array]:
    """Continuous states after a step; one with dry friction that has changed its direction has stopped instead."""
    parts = [moved[i] for i in range(system.continuous_count)]
    if sign is not None:
        for j, i in enumerate(system.friction_indices()):
            parts[i] = np.where(sign[j] * parts[i] < 0.0, 0.0, parts[i])
    return parts


def _at_rest(system: HybridSystem, t: Array, x: Array, u: Array, p: Array, sign: Array | None) -> Array | None:
    """1 for continuous states at rest under a dry friction that is not zero, else 0, shape (nc,)."""
    if sign is None:
        return None
    friction, indices = system.friction_vector(t, x, u, p), system.friction_indices()
    parts = [0.0 * sign[0]] * system.continuous_count
    for j, i in enumerate(indices):
        parts[i] = np.where(sign[j] == 0.0, np.where(friction[j] > 0.0, 1.0, 0.0), 0.0)
    return _stack(parts)


def _before_memory(parts: list[Array], x: Array, system: HybridSystem) -> Array:
    """Continuous states, and behind them the memory of `x`: in one piece where all are numbers."""
    count = system.continuous_count
    if isinstance(x, np.ndarray) and all(isinstance(part, np.ndarray | np.generic) for part in parts):
        return np.concatenate([np.stack(parts), x[count : system.state_count]])
    return _stack([*parts, *(x[i] for i in range(count, system.state_count))])


def _stack(parts: list[Array]) -> Array:
    return np.stack(parts)
