"""One step of the implicit discrete filtering differentiator, and the equation it solves. Pure functions that trace."""

from __future__ import annotations

from collections.abc import Sequence
from math import factorial

import numpy as np

from fmu_observer.formulas.differentiation.differentiator import power
from fmu_observer.formulas.differentiation.differentiator_gains import LEVANT_GAINS
from plant_models.hybrid import Array

ITERATIONS = 7  # Newton from at most twice the root: the last two change nothing any more
_SMALLEST = 1e-200  # stands in for an excess that is not positive, where the root is not used


def implicit_step(
    w: Sequence[Array], z: Sequence[Array], signal: Array, L: Array, tau: Array
) -> tuple[list[Array], list[Array]]:
    """The next filter states and estimates: Bouchama 2024, (1.36) with Theorem 5, its third case repaired.

    ``w_i+ = tau^(nf-i+1)/(nf-i+1)! (z_0 - f) + sum_{l=i..nf} tau^(l-i)/(l-i)! w_l + sum_{l=i..m+1} tau^(l-i+1)/(l-i+1)!
    v_{l-1}``, ``z_j+ = sum_{l=j..n} [tau^(l-j)/(l-j)! z_l + tau^(l-j+1)/(l-j+1)! v_{nf+l}]`` with ``v_j = -g_{m-j}
    L^((j+1)/(m+1)) |w_1+|^((m-j)/(m+1)) xi``, m = n + nf, g the row m of Table 1.1.

    Args:
        w: filter states, nf >= 1 scalars. z: estimates of the signal and its n derivatives, n + 1 scalars.
        signal: sample of the signal at the time of w and z. L: bound of its derivative n + 1. tau: sampling period [s].

    Returns:
        w and z one period later.
    """
    n, nf = len(z) - 1, len(w)
    m = n + nf
    gains = LEVANT_GAINS[m]
    error = z[0] - signal
    b = -_taylor(tau, nf) * error - sum(_taylor(tau, i) * w[i] for i in range(nf))
    root, sign = solve_first_filter_equation(b, equation_coefficients(m, L, tau))
    v = [-gains[m - j] * power(L, j + 1, m + 1) * _whole_power(root, m - j) * sign for j in range(m + 1)]
    w_next = [
        _taylor(tau, nf - i) * error
        + sum(_taylor(tau, k - i) * w[k] for k in range(i, nf))
        + sum(_taylor(tau, k - i + 1) * v[k] for k in range(i, m + 1))
        for i in range(nf)
    ]
    z_next = [
        sum(_taylor(tau, k - j) * z[k] + _taylor(tau, k - j + 1) * v[nf + k] for k in range(j, n + 1))
        for j in range(n + 1)
    ]
    return w_next, z_next


def equation_coefficients(m: int, L: Array, tau: Array) -> list[Array]:
    """``a_j = tau^(m-j+1)/(m-j+1)! g_j L^((m-j+1)/(m+1))``, j = 0 ... m, of Theorem 5."""
    return [_taylor(tau, m - j + 1) * LEVANT_GAINS[m][j] * power(L, m - j + 1, m + 1) for j in range(m + 1)]


def solve_first_filter_equation(b: Array, a: Sequence[Array]) -> tuple[Array, Array]:
    """Root r and sign xi of Theorem 5; then ``w_1+ = xi r^(m+1)``.

    ``|b| <= a_0``: r = 0, ``xi = -b / a_0``. Else ``xi = -sgn(b)`` and r > 0 solves
    ``r^(m+1) + a_m r^m + ... + a_1 r = |b| - a_0``. The print has another sign in the case b < -a_0. Newton's method
    from above, where the polynomial is increasing and convex, cannot fail; it starts from the smallest root that one
    term alone would give, which is at most twice the true one.

    Args:
        b: the known part of the first filter equation. a: a_0 ... a_m, positive.
    """
    degree = len(a)
    excess = np.abs(b) - a[0]
    right = np.maximum(excess, _SMALLEST)
    r = right ** (1.0 / degree)
    for j in range(1, degree):
        r = np.minimum(r, (right / a[j]) ** (1.0 / j))
    for _ in range(ITERATIONS):
        value, slope = 1.0 + 0.0 * r, 0.0 * r
        for j in range(degree - 1, -1, -1):  # Horner, a_0 replaced by minus the right-hand side
            slope = slope * r + value
            value = value * r + (a[j] if j else -right)
        r = r - value / slope
    return np.where(excess > 0.0, r, 0.0), -np.clip(b / a[0], -1.0, 1.0)


def _taylor(tau: Array, order: int) -> Array:
    return _whole_power(tau, order) / float(factorial(order))


def _whole_power(value: Array, exponent: int) -> Array:
    result: Array = 1.0
    for _ in range(exponent):
        result = result * value
    return result
