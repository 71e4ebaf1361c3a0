"""Integration: one internal step of a hybrid system, written in the same plain NumPy as the system.

`rk4` for smooth equations, `rosenbrock` (linearly implicit, L-stable) for stiff ones; dry friction is set-valued and
resolved inside the step. The functions trace like the system does; they know nothing of events or of who calls them.
"""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt

import numpy as np

from plant_models.hybrid.system import Array, HybridSystem

Derivative = Callable[[Array, Array], Array]  # (t, x) -> derivative of the continuous states
Jacobian = Callable[[Array, Array], tuple[Array, Array]]  # (t, x) -> (d/dx of shape (nc, nc), d/dt of shape (nc,))

ROSENBROCK_GAMMA = 1.0 - 1.0 / sqrt(2.0)

BEND_STEEPNESS = 3.0
"""How much steeper than the secant over it a bend is taken to be. With 1 a wheel may jump to and fro across the creep curve's
rise; with 2 and with 3 no start was found from which it does (`test_sliding_wheel`)."""


def effective_flow(system: HybridSystem, t: Array, x: Array, u: Array, p: Array, sign: Array | None) -> Array:
    """Derivative with dry friction resolved for one direction of motion.

    A state that moves (sign +1 or -1) feels the full friction against its motion. A state at rest (sign 0) feels just
    the friction that holds it, up to the full one: the set-valued Coulomb law.

    Args:
        t: time [s]. x: state, shape (n,). u: inputs, shape (m,). p: parameters, shape (k,).
        sign: signs of the states with friction at the start of the step, shape (nf,), or None without friction.

    Returns:
        Derivatives of the continuous states, shape (nc,).
    """
    derivative = system.state_derivative(t, x, u, p)
    if sign is None:
        return derivative
    friction = system.friction_vector(t, x, u, p)
    parts = [derivative[i] for i in range(system.continuous_count)]
    for j, i in enumerate(system.friction_indices()):
        held = np.clip(parts[i], -friction[j], friction[j])
        parts[i] = parts[i] - np.where(sign[j] == 0.0, held, sign[j] * friction[j])
    return _stack(parts)


def step(system: HybridSystem, t: Array, h: Array, x: Array, u: Array, p: Array, jacobian: Jacobian | None = None) -> Array:
    """State after one internal step by the system's own method.

    Args:
        t: time at the start [s]. h: step [s]. x: state, shape (n,). u: inputs held over the step, shape (m,). p: shape (k,).
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
    rest = [x[i] for i in range(count, system.state_count)]

    def derivative(time: Array, continuous: Array) -> Array:
        whole = _stack([*(continuous[i] for i in range(count)), *rest]) if rest else continuous
        return effective_flow(system, time, whole, u, p, sign)

    if system.method == "rk4":
        moved = rk4_step(derivative, t, h, x[:count])
    elif system.method == "rosenbrock":
        if jacobian is None:
            raise ValueError(f"{system.name}: the rosenbrock step needs the Jacobian of the flow.")
        moved = rosenbrock_step(derivative, jacobian, t, h, x[:count])
    else:
        raise ValueError(f"{system.name}: unknown method {system.method!r}; use 'rk4' or 'rosenbrock'.")
    parts = [moved[i] for i in range(count)]
    if sign is not None:
        for j, i in enumerate(system.friction_indices()):
            parts[i] = np.where(sign[j] * parts[i] < 0.0, 0.0, parts[i])
    return _stack([*parts, *rest])


def rk4_step(derivative: Derivative, t: Array, h: Array, x: Array) -> Array:
    """The classical Runge-Kutta step of order 4."""
    k1 = derivative(t, x)
    k2 = derivative(t + 0.5 * h, x + 0.5 * h * k1)
    k3 = derivative(t + 0.5 * h, x + 0.5 * h * k2)
    k4 = derivative(t + h, x + h * k3)
    return x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


def rosenbrock_step(derivative: Derivative, jacobian: Jacobian, t: Array, h: Array, x: Array) -> Array:
    """The two-stage Rosenbrock step ROS2 of order 2, L-stable with gamma = 1 - 1/sqrt(2), guarded against steep bends.

    ``(I - g h J) k1 = f(t, x) + g h f_t``, ``(I - g h J) k2 = f(t+h, x + h k1) - 2 k1 - g h f_t``,
    ``x+ = x + h (3 k1 + k2) / 2`` (Verwer, Spee, Blom, Hundsdorfer, SIAM J. Sci. Comput. 20 (1999) 1456-1480). Linear
    systems, no iteration: the cost is fixed and the step can be generated as straight-line C.

    The Jacobian knows the slope here and nothing of a steep part that the stage leaps over, such as the rise of a creep curve
    between two flat branches. There the two stages may cancel, and a sliding wheel would slide for ever. Where the stage has
    turned a derivative round, by more than the Jacobian explains, `damped_step` takes its place.
    """
    by_state, by_time = jacobian(t, x)
    gamma_h = ROSENBROCK_GAMMA * h
    matrix = np.eye(x.shape[0]) - gamma_h * by_state
    flow = derivative(t, x)
    k1 = np.linalg.solve(matrix, flow + gamma_h * by_time)
    ahead = derivative(t + h, x + h * k1)
    k2 = np.linalg.solve(matrix, ahead - 2.0 * k1 - gamma_h * by_time)
    smooth = x + 0.5 * h * (3.0 * k1 + k2)
    change, predicted = ahead - flow, h * (by_state @ k1 + by_time)
    turned = np.where(change * k1 < 0.0, np.minimum(flow * ahead, 0.0), 0.0)  # negative where it came back over zero
    bent = np.where(np.abs(change - predicted) > np.abs(flow), turned, 0.0)
    return np.where(np.sum(bent) < 0.0, damped_step(by_state, h * k1, BEND_STEEPNESS * change - predicted, h, x, flow), smooth)


def damped_step(by_state: Array, move: Array, missing: Array, h: Array, x: Array, flow: Array) -> Array:
    """The linearly implicit Euler step with a Jacobian that explains `missing` more change over `move`, by Broyden's update.

    The update adds a multiple of `missing` in every column, so that what the flow conserves, momentum above all, stays conserved.
    """
    length = move @ move
    steeper = by_state + np.outer(missing, move) / np.where(length == 0.0, 1.0, length)
    return x + np.linalg.solve(np.eye(x.shape[0]) - h * steeper, h * flow)


def _friction_sign(system: HybridSystem, x: Array) -> Array | None:
    indices = system.friction_indices()
    return _stack([np.sign(x[i]) for i in indices]) if indices else None


def _stack(parts: list[Array]) -> Array:
    return np.stack(parts)
