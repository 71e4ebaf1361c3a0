"""O4: Levant's differentiator of a signal as a system. The equations are in `differentiator`."""

from __future__ import annotations

from typing import Any

from fmu_observer.formulas.differentiation.differentiator import differentiator_flow
from fmu_observer.models.observer_model import named_as, stacked_of
from fmu_observer.observers.generic.differentiators.signal_differentiator import LARGEST, SignalDifferentiator
from plant_models.hybrid import Array


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
    internal_step = 1e-3
    method = "euler"  # Levant's discretisation; stages of a higher order see a signal that stands still while they move
    option_choices = {"order": tuple(range(LARGEST + 1))}

    def __init__(self, order: int = 2, unit: str = "1") -> None:
        super().__init__(order, 0, unit)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return named_as(self.estimates, differentiator_flow(stacked_of(x, self.estimates), u.signal, p.bound))

    def interval(self, p: Any) -> float:
        """The internal step [s]."""
        return float(p.internal_step)
