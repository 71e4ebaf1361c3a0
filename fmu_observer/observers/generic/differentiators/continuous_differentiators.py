"""Levant's differentiator and the filtering one as systems. The equations are in `differentiator`."""

from __future__ import annotations

from typing import Any

from fmu_observer.formulas.differentiation.differentiator import differentiator_flow, filtering_differentiator_flow
from fmu_observer.models.observer_model import named_as, stacked_of
from fmu_observer.observers.generic.differentiators.signal_differentiator import FILTERED, LARGEST, SignalDifferentiator
from plant_models.hybrid import Array


class FilteringDifferentiator(SignalDifferentiator):
    """Differentiation order n with nf filter states, m = n + nf: Bouchama 2024, (1.16), Theorem 4.

    ``dW_i = -g_{m+1-i} L^(i/(m+1)) |W_1|^((m+1-i)/(m+1)) sgn(W_1) + W_{i+1}``, ``z_0 - f`` in place of ``W_{nf+1}``,
    and ``dz_j = -g_{n-j} L^((nf+1+j)/(m+1)) |W_1|^((n-j)/(m+1)) sgn(W_1) + z_{j+1}``, g the row m of Table 1.1.
    Repaired: the exponent nf + 1 + j is the general one, the print shows that of j = 0 in two places. It rejects noise
    with a small integral of order up to nf, however large: a fast oscillation, a spike.

    Args:
        order: n. filtering_order: nf, at least 1; n + nf at most 5. unit: unit of the signal.
    """

    name = "filtering_differentiator"
    description = "Filtering differentiator of a signal"
    source = "Bouchama 2024, (1.16), Theorem 4, general exponent"
    method = "euler"  # Levant's discretisation; stages of a higher order see a signal that stands still while they move
    option_choices, least_filtering = FILTERED, 1

    def __init__(self, order: int = 1, filtering_order: int = 3, unit: str = "1") -> None:
        super().__init__(order, filtering_order, unit)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        w, z = stacked_of(x, self.filters), stacked_of(x, self.estimates)
        dw, dz = filtering_differentiator_flow(w, z, u.signal, p.bound)
        return named_as((*self.filters, *self.estimates), (*dw, *dz))

    def interval(self, p: Any) -> float:
        """The internal step [s]."""
        return float(p.internal_step)


class LevantDifferentiator(SignalDifferentiator):
    """Levant's differentiator ``dz_i = -g_i L^((i+1)/(n+1)) |s|^((n-i)/(n+1)) sgn(s) + z_{i+1}``: Bouchama 2024,
    (1.14).

    Theorem 3, with ``s = z_0 - f``. Repaired: the gains are Table 1.1 in the order in which it works,
    ``g_i = table[n][n - i]``; in the printed order of the indices the estimates are wrong from n = 2 on. Without noise
    the estimates are exact after a finite time; with noise of size eps derivative i is within a constant of
    ``L^(i/(n+1)) eps^((n+1-i)/(n+1))``. The equations are discontinuous; at the internal step h they chatter by the
    order of ``L h^(n+1-i)``.

    Args:
        order: number n of derivatives, 0 to 5. unit: unit of the signal.
    """

    name = "levant_differentiator"
    description = "Levant's exact differentiator of a signal"
    source = "Bouchama 2024, (1.14), Theorem 3, gains in working order"
    method = "euler"  # Levant's discretisation; stages of a higher order see a signal that stands still while they move
    option_choices = {"order": tuple(range(LARGEST + 1))}

    def __init__(self, order: int = 2, unit: str = "1") -> None:
        super().__init__(order, 0, unit)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return named_as(self.estimates, differentiator_flow(stacked_of(x, self.estimates), u.signal, p.bound))

    def interval(self, p: Any) -> float:
        """The internal step [s]."""
        return float(p.internal_step)
