"""Jacobians of the motor's Euler step and of its measured currents. Pure functions that trace."""

from __future__ import annotations

from typing import Any

from plant_models.hybrid import Array


def rotor_jacobian(current_d: Array, current_q: Array, speed: Array, period: Array, p: Any) -> list[list[Array]]:
    """Rows of ``F = d x(k+1) / d x(k)`` with voltages given in the rotor frame, 4 by 4.

    Args:
        current_d: along d [A]. current_q: along q [A]. speed: of the shaft [rad/s]. period: T_s [s].
        p: parameters of the motor.

    Returns:
        Four rows of four entries.

    Source: Allaoui 2024, "3.42" (4.42), repaired: current q in the first row, minus in the second, L_q under R_s.
    """
    electrical, saliency = p.pole_pairs * speed, p.inductance_d - p.inductance_q
    share_d, share_q = period / p.inductance_d, period / p.inductance_q
    torque, pairs = period * 1.5 * p.pole_pairs / p.inertia, p.pole_pairs
    by_speed = (
        share_d * p.inductance_q * pairs * current_q,
        -share_q * pairs * (p.inductance_d * current_d + p.rotor_flux),
        1.0 - period * p.viscous_friction / p.inertia,
        period * pairs,
    )
    return [
        [1.0 - share_d * p.stator_resistance, share_d * p.inductance_q * electrical, by_speed[0], 0.0],
        [-share_q * p.inductance_d * electrical, 1.0 - share_q * p.stator_resistance, by_speed[1], 0.0],
        [torque * saliency * current_q, torque * (saliency * current_d + p.rotor_flux), by_speed[2], 0.0],
        [0.0, 0.0, by_speed[3], 1.0],
    ]
