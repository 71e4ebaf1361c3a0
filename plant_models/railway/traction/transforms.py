"""Transforms of three-phase quantities: Clarke, Concordia, rotation, Park, and back. Pure functions.

A frame has two axes and, where phases do not add up to zero, a zero component. *Amplitude-invariant* (Clarke): a
balanced set of phases of amplitude A has a vector of length A; power is ``3/2 (v . i)``. *Power-invariant* (Concordia):
the vector is longer by ``sqrt(3/2)``, and power is ``v . i``. The motors and the control here use Clarke: their torque
carries the factor 3/2.
Knows arrays only.
"""

from __future__ import annotations

import numpy as np

from plant_models.hybrid import Array

ROOT_3 = float(np.sqrt(3.0))
TO_CONCORDIA = float(np.sqrt(1.5))
"""Length of a power-invariant vector over that of the amplitude-invariant one."""

Pair = tuple[Array, Array]
Triple = tuple[Array, Array, Array]


def clarke(a: Array, b: Array, c: Array) -> Triple:
    """Phases to the stator frame (alpha, beta, zero), amplitude-invariant.

    Args:
        a: quantity of the first phase, in any unit. b: of the second. c: of the third.

    Returns:
        Components along alpha and beta, and the mean of the phases, in the same unit.

    Source: Allaoui 2024, (b.1)-(b.2), m = 1.
    """
    return (2.0 * a - b - c) / 3.0, (b - c) / ROOT_3, (a + b + c) / 3.0


def inverse_clarke(alpha: Array, beta: Array, zero: Array = 0.0) -> Triple:
    """The stator frame to phases; the inverse of `clarke`.

    Args:
        alpha: component along alpha, in any unit. beta: along beta. zero: mean of the phases.

    Returns:
        Quantities of the three phases, in the same unit.

    Source: Allaoui 2024, (b.1)-(b.2), inverted.
    """
    half, part = 0.5 * alpha, 0.5 * ROOT_3 * beta
    return zero + alpha, zero - half + part, zero - half - part


def concordia(a: Array, b: Array, c: Array) -> Triple:
    """Phases to the stator frame (alpha, beta, zero), power-invariant: an orthogonal matrix.

    Args:
        a: quantity of the first phase, in any unit. b: of the second. c: of the third.

    Returns:
        Components along alpha, beta and zero, in the same unit; their squares add up to those of the phases.

    Source: Allaoui 2024, (b.1) and (b.3), m = 1/2.
    """
    alpha, beta, zero = clarke(a, b, c)
    return TO_CONCORDIA * alpha, TO_CONCORDIA * beta, ROOT_3 * zero


def inverse_concordia(alpha: Array, beta: Array, zero: Array = 0.0) -> Triple:
    """The power-invariant stator frame to phases; the inverse of `concordia`.

    Args:
        alpha: component along alpha, in any unit. beta: along beta. zero: zero component.

    Returns:
        Quantities of the three phases, in the same unit.

    Source: Allaoui 2024, (b.1) and (b.3), inverted.
    """
    return inverse_clarke(alpha / TO_CONCORDIA, beta / TO_CONCORDIA, zero / ROOT_3)


def to_rotor(alpha: Array, beta: Array, angle: Array) -> Pair:
    """The stator frame (alpha, beta) to the rotor frame (d, q).

    Args:
        alpha: component along alpha, in any unit. beta: along beta. angle: electrical angle of the rotor [rad].

    Returns:
        Components along d and q, in the same unit.

    Source: Allaoui 2024, (b.4).
    """
    cosine, sine = np.cos(angle), np.sin(angle)
    return cosine * alpha + sine * beta, cosine * beta - sine * alpha


def to_stator(d: Array, q: Array, angle: Array) -> Pair:
    """The rotor frame (d, q) to the stator frame (alpha, beta); the inverse of `to_rotor`.

    Args:
        d: component along d, in any unit. q: along q. angle: electrical angle of the rotor [rad].

    Returns:
        Components along alpha and beta, in the same unit.

    Source: Allaoui 2024, (b.4), inverted.
    """
    cosine, sine = np.cos(angle), np.sin(angle)
    return cosine * d - sine * q, sine * d + cosine * q


def park(a: Array, b: Array, c: Array, angle: Array) -> Pair:
    """Phases to the rotor frame (d, q), amplitude-invariant.

    The thesis prints the power-invariant matrix beside a torque that carries the factor 3/2, which is that of the
    amplitude-invariant one; and the first sine of its second row without the minus sign.

    Args:
        a: quantity of the first phase, in any unit. b: of the second. c: of the third.
        angle: electrical angle of the rotor [rad].

    Returns:
        Components along d and q, in the same unit.

    Source: Allaoui 2024, (b.5), repaired.
    """
    alpha, beta, _ = clarke(a, b, c)
    return to_rotor(alpha, beta, angle)


def inverse_park(d: Array, q: Array, angle: Array) -> Triple:
    """The rotor frame (d, q) to phases that add up to zero; the inverse of `park`.

    Args:
        d, q, angle: as of `to_stator`.

    Returns:
        Quantities of the three phases, in the same unit.

    Source: Allaoui 2024, (b.5), inverted.
    """
    return inverse_clarke(*to_stator(d, q, angle))
