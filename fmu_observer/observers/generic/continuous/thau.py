"""O2: Thau's observer, a Luenberger gain with a Lipschitz condition that holds everywhere."""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.certificates.finding import Finding, condition_found
from fmu_observer.certificates.lipschitz_condition import best_thau_bound, scaled_thau_bound
from fmu_observer.design.pole_placement import observer_gain
from fmu_observer.models.observer_model import ObserverModel
from fmu_observer.observers.generic.continuous.luenberger import Luenberger

SPEED = 2.0  # [1/s] of the default poles [ours]


class Thau(Luenberger):
    """Thau's observer ``dxh = A xh + B u + phi(xh, u) - L (C xh - y)`` with phi Lipschitz: Bouchama 2024, (1.6)-(1.9),
    Theorem 1.

    With ``(A - L C)' P + P (A - L C) = -Q`` the printed condition ``alpha < lmax(Q) / lmin(P)`` (1.8) is unsafe.
    `condition` judges by the valid one, ``alpha < lmin(Q) / (2 lmax(P))`` at Q = I, and gives the printed number beside
    it. A Lipschitz constant depends on the units of the states, so the best coordinates ``z_i = x_i / scale^(i-1)`` are
    searched for too, and the condition may hold in any of them.

    Default L [ours]: with one measurement all poles of ``A - L C`` at -2 1/s, for two states the gain (4, 4); the valid
    bound is then 0.438 and the printed one 7.12. With several measurements the poles lie from -2 1/s on.
    """

    name = "thau"
    description = "Thau observer: Luenberger gain with a Lipschitz condition"
    source = "Bouchama 2024, (1.6)-(1.9), Theorem 1, condition repaired"

    @staticmethod
    def default_gain(model: ObserverModel) -> np.ndarray:
        """Gain L of the default poles of ``A - L C``, A without phi, shape (n, q)."""
        spread = 0.0 if len(model.measurements) == 1 else 0.25
        poles = -SPEED * (1.0 + spread * np.arange(model.order))
        return observer_gain(model.A, model.C, poles, tuple(s.name for s in model.states), model.name)

    def condition_of(self, p: Any) -> Finding:
        """The valid bound against the Lipschitz constant, in the model's own and in the best scaled coordinates."""
        L = np.asarray(self.gain_matrix(p))
        plain, best = scaled_thau_bound(self.model, L), best_thau_bound(self.model, L)
        return condition_found(
            holds=plain.holds or best.holds,
            numbers={
                "lipschitz [1/s]": plain.lipschitz,
                "bound [1/s]": plain.valid,
                "printed_bound [1/s]": plain.printed,
                "scale": best.scale,
                "scaled_lipschitz [1/s]": best.lipschitz,
                "scaled_bound [1/s]": best.valid,
            },
            statement="lipschitz < bound = 1 / (2 lmax(P)), or the same in scaled coordinates; printed_bound is not "
            "safe",
            source="Bouchama 2024, (1.8), Theorem 1, repaired",
        )
