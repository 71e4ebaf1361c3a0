"""O6: the implicit discrete filtering differentiator as a system. The equations are in `implicit_recursion`."""

from __future__ import annotations

from collections.abc import Sequence
from math import factorial
from typing import Any

import numpy as np

from fmu_observer.formulas.differentiation.differentiator import power
from fmu_observer.formulas.differentiation.differentiator_gains import LEVANT_GAINS
from fmu_observer.models.observer_model import named_as, stacked_of
from fmu_observer.observers.generic.differentiators.signal_differentiator import FILTERED, SignalDifferentiator
from fmu_observer.observers.generic.discrete.arrivals import at_sample, initialised_memory
from plant_models.hybrid import Array, PeriodicEvent, memory, parameter
from plant_models.hybrid.missing import or_else

_ITERATIONS = 7  # Newton from at most twice the root: the last two change nothing any more
_SMALLEST = 1e-200  # stands in for an excess that is not positive, where the root is not used


class ImplicitDifferentiator(SignalDifferentiator):
    """Implicit discretisation of the filtering differentiator: Bouchama 2024, (1.36), Theorem 5.

    The sign is taken at the end of the step, from an equation that is solved exactly. What is left is a limit cycle of
    the order of ``L tau^(n+1-i)``, because z_0 - f is held over the step; for n = 1 less than half of that of an
    explicit step. Repaired:
    in the case ``b < -a_0`` of Theorem 5, xi = +1 and ``w_1 = +r^(m+1)``. The root is found by a fixed number of Newton
    steps that are safe and enough for rounding accuracy.

    At a sample the step from the last one is taken with the signal read there; the estimates published then belong to
    this sample. A sample that is missing (NaN) drives nothing.

    Args:
        order: n. filtering_order: nf, at least 1; n + nf at most 5. unit: unit of the signal.
    """

    name = "implicit_differentiator"
    description = "Implicit discrete filtering differentiator of a sampled signal"
    source = "Bouchama 2024, (1.36), Theorem 5, third case repaired"
    discrete = True
    option_choices, least_filtering = FILTERED, 1

    def __init__(self, order: int = 1, filtering_order: int = 3, unit: str = "1") -> None:
        text = "The signal is read"
        self.events = (
            PeriodicEvent("sampling", "sample_period", description=text, samples=("signal",), leaves_out=True),
        )
        super().__init__(
            order,
            filtering_order,
            unit,
            extra_parameters=(parameter("sample_period", "s", 0.01, "Sampling period of the signal", min=1e-6),),
            extra_memory=initialised_memory(memory("held_signal", unit, 0.0, "Signal at the last sample")),
        )

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The step from the last sample to this one; then the signal is read."""

        def advance(x: Any) -> dict[str, Array]:
            w, z = stacked_of(x, self.filters), stacked_of(x, self.estimates)
            w_next, z_next = _implicit_step(w, z, x.held_signal, p.bound, p.sample_period)
            return named_as((*self.filters, *self.estimates), (*w_next, *z_next))

        def read(x: Any) -> dict[str, Array]:  # where the signal is missing it is taken to be what is estimated
            return {"held_signal": or_else(u.signal, x.estimated_value)}

        return at_sample(x, advance, read)

    def interval(self, p: Any) -> float:
        """The sampling period [s]."""
        return float(p.sample_period)


def _implicit_step(
    w: Sequence[Array], z: Sequence[Array], signal: Array, L: Array, tau: Array
) -> tuple[list[Array], list[Array]]:
    """The next filter states and estimates: Bouchama 2024, (1.36) with Theorem 5, its third case repaired.

    ``w_i+ = tau^(nf-i+1)/(nf-i+1)! (z_0 - f) + sum_{l=i..nf} tau^(l-i)/(l-i)! w_l + sum_{l=i..m+1} tau^(l-i+1)/(l-i+1)!
    v_{l-1}``, ``z_j+ = sum_{l=j..n} [tau^(l-j)/(l-j)! z_l + tau^(l-j+1)/(l-j+1)! v_{nf+l}]`` with ``v_j = -g_{m-j}
    L^((j+1)/(m+1)) |w_1+|^((m-j)/(m+1)) xi``, m = n + nf, g the row m of Table 1.1.
    """
    n, nf = len(z) - 1, len(w)
    m = n + nf
    gains = LEVANT_GAINS[m]
    error = z[0] - signal
    b = -_taylor(tau, nf) * error - sum(_taylor(tau, i) * w[i] for i in range(nf))
    root, sign = _solve_first_filter_equation(b, _equation_coefficients(m, L, tau))
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


def _equation_coefficients(m: int, L: Array, tau: Array) -> list[Array]:
    """``a_j = tau^(m-j+1)/(m-j+1)! g_j L^((m-j+1)/(m+1))``, j = 0 ... m, of Theorem 5."""
    return [_taylor(tau, m - j + 1) * LEVANT_GAINS[m][j] * power(L, m - j + 1, m + 1) for j in range(m + 1)]


def _solve_first_filter_equation(b: Array, a: Sequence[Array]) -> tuple[Array, Array]:
    """Root r and sign xi of Theorem 5; then ``w_1+ = xi r^(m+1)``.

    ``|b| <= a_0``: r = 0, ``xi = -b / a_0``. Else ``xi = -sgn(b)`` and r > 0 solves
    ``r^(m+1) + a_m r^m + ... + a_1 r = |b| - a_0``. The print has another sign in the case b < -a_0. Newton's method
    from above, where the polynomial is increasing and convex, cannot fail; it starts from the smallest root that one
    term alone would give, which is at most twice the true one.
    """
    degree = len(a)
    excess = np.abs(b) - a[0]
    right = np.maximum(excess, _SMALLEST)
    r = right ** (1.0 / degree)
    for j in range(1, degree):
        r = np.minimum(r, (right / a[j]) ** (1.0 / j))
    for _ in range(_ITERATIONS):
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
