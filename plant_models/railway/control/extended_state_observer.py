"""The linear extended state observer of a mass: speed, and everything that disturbs it as one acceleration. Pure
functions.
"""

from __future__ import annotations

from plant_models.hybrid import Array


def observer_derivative(
    measured: Array, speed: Array, disturbance: Array, applied_acceleration: Array, bandwidth: Array
) -> tuple[Array, Array]:
    """Derivatives of both estimates: ``dz1 = z2 + b0 F + 2 wo (y - z1)``, ``dz2 = wo^2 (y - z1)``.

    Both poles of the estimation error lie at ``-wo`` (bandwidth parametrisation). `applied_acceleration` must come from
    the effort that is really applied, behind all limits: then a limit is no disturbance and nothing winds up.

    Args:
        measured: speed y [m/s]. speed: its estimate z1 [m/s]. disturbance: estimate z2 of all other accelerations
            [m/s2].
        applied_acceleration: applied effort over mass, b0 F [m/s2]. bandwidth: wo [rad/s].

    Returns:
        Derivatives of speed estimate [m/s2] and disturbance estimate [m/s3].

    Source: Gao, Scaling and bandwidth-parameterization based controller tuning, American Control Conference 2003.
    """
    innovation = measured - speed
    return disturbance + applied_acceleration + 2.0 * bandwidth * innovation, bandwidth * bandwidth * innovation


def rejecting_force(error: Array, acceleration: Array, disturbance: Array, mass: Array, bandwidth: Array) -> Array:
    """Force ``M (wc e + a_ref - z2)`` [N]: first order towards the reference, the disturbance taken out.

    Args:
        error: speed reference minus estimate [m/s]. acceleration: of the reference [m/s2]. disturbance: z2 [m/s2].
        mass: M = 1 / b0 [kg]. bandwidth: wc [rad/s].
    """
    return mass * (bandwidth * error + acceleration - disturbance)
