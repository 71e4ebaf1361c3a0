"""Homogeneous sliding-mode differentiators of any order, plain and filtering. Pure functions of their states.

The right-hand sides are discontinuous at a zero error; at a fixed step h the states then chatter, the highest one
within about ``L h``.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fmu_observer.formulas.differentiation.differentiator_gains import LEVANT_GAINS
from plant_models.hybrid import Array


def differentiator_flow(z: Sequence[Array], signal: Array, L: Array) -> list[Array]:
    """Derivatives of Levant's differentiator of order n = len(z) - 1: Bouchama 2024, (1.14).

    ``dz_i = -g_i L^((i+1)/(n+1)) |s|^((n-i)/(n+1)) sgn(s) + z_{i+1}``, ``s = z_0 - signal``, with ``g_i`` the entry n -
    i of row n of Table 1.1: the table lists the gains in the opposite order of the equations.

    Args:
        z: estimates of the signal and its n derivatives, n + 1 scalars.
        signal: the signal to differentiate.
        L: bound of its derivative of order n + 1.

    Returns:
        n + 1 derivatives.

    Raises:
        ValueError: no gains are tabulated for this order.
    """
    n = len(z) - 1
    gains = _gains(n)
    error = z[0] - signal
    return [
        -gains[n - i] * power(L, i + 1, n + 1) * _signed_power(error, n - i, n + 1) + _next(z, i) for i in range(n + 1)
    ]


def filtering_differentiator_flow(
    w: Sequence[Array], z: Sequence[Array], signal: Array, L: Array
) -> tuple[list[Array], list[Array]]:
    """Derivatives of the filtering differentiator, n = len(z) - 1, nf = len(w) >= 1: Bouchama 2024, (1.16), (3.18).

    With m = n + nf and g the row m of Table 1.1:
    ``dw_i = -g_{m+1-i} L^(i/(m+1)) |w_1|^((m+1-i)/(m+1)) sgn(w_1) + w_{i+1}`` (``z_0 - signal`` in place of
    ``w_{nf+1}``), ``dz_j = -g_{n-j} L^((nf+1+j)/(m+1)) |w_1|^((n-j)/(m+1)) sgn(w_1) + z_{j+1}``. The exponent nf+1+j is
    the general one; the print shows that of j = 0 in two places.

    Args:
        w: filter states, nf scalars. z: estimates of the signal and its n derivatives, n + 1 scalars.
        signal: the signal to differentiate. L: bound of its derivative of order n + 1.

    Returns:
        The nf derivatives of w and the n + 1 derivatives of z.

    Raises:
        ValueError: no filter state is given, or no gains are tabulated for n + nf.
    """
    n, nf = len(z) - 1, len(w)
    if nf < 1:
        raise ValueError("A filtering differentiator needs at least one filter state; use differentiator_flow without.")
    m = n + nf
    gains = _gains(m)
    chain = [*w, z[0] - signal]
    dw = [-gains[m - i] * power(L, i + 1, m + 1) * _signed_power(w[0], m - i, m + 1) + chain[i + 1] for i in range(nf)]
    dz = [
        -gains[n - j] * power(L, nf + 1 + j, m + 1) * _signed_power(w[0], n - j, m + 1) + _next(z, j)
        for j in range(n + 1)
    ]
    return dw, dz


def power(value: Array, numerator: int, denominator: int) -> Array:
    """``value^(numerator/denominator)`` of a number that is not negative, numerator >= 1.

    As a power of the root, because all the powers that a differentiator needs then share one root: roots are most of
    its cost.
    """
    if numerator == denominator:
        return value
    root = value ** (1.0 / denominator)
    result = root
    for _ in range(numerator - 1):
        result = result * root
    return result


def _signed_power(value: Array, numerator: int, denominator: int) -> Array:
    """``|value|^(numerator/denominator) sgn(value)``."""
    return np.sign(value) if numerator == 0 else power(np.abs(value), numerator, denominator) * np.sign(value)


def _next(z: Sequence[Array], i: int) -> Array:
    return z[i + 1] if i + 1 < len(z) else 0.0


def _gains(order: int) -> tuple[float, ...]:
    if not 0 <= order < len(LEVANT_GAINS):
        raise ValueError(f"No differentiator gains for order {order}; tabulated are 0 to {len(LEVANT_GAINS) - 1}.")
    return LEVANT_GAINS[order]
