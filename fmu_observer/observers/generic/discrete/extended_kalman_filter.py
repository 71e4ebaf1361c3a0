"""The extended Kalman filter with exact Jacobians, and that of linear models."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fmu_observer.formulas.filtering import kalman, square_root
from fmu_observer.formulas.filtering.kalman import Corrected
from fmu_observer.models.filter_models import Known
from fmu_observer.models.known_models import MODELS, find_model
from fmu_observer.models.observer_model import ObserverModel
from fmu_observer.models.traced_system_model import Source
from fmu_observer.observability import require_detectable_model
from fmu_observer.observers.generic.discrete.filter_signals import Belief
from fmu_observer.observers.generic.discrete.gaussian_filter import GaussianFilter
from plant_models.hybrid import Array
from plant_models.hybrid.missing import is_there, or_else


class ExtendedKalmanFilter(GaussianFilter):
    """First-order extended Kalman filter: Allaoui 2024, (2.25)-(2.31); Bouchama 2024, section 1.3, names it.

    At a sample: ``xh(k|k-1) = f(xh(k-1|k-1), u, 0)`` is the model over one period, inputs held,
    ``P(k|k-1) = F P F' + W QN W'`` with F and W the exact Jacobians of that transition; then
    ``K = P H' inv(H P H' + V RN V')``, ``xh(k|k) = xh(k|k-1) + K (y - h(xh(k|k-1), 0))`` and P(k|k) in the chosen form,
    H and V exact Jacobians at xh(k|k-1). Noise is additive (W, V identities) unless inputs of the model are declared
    for it. QN belongs to one period and must be given anew with another (`design.discretisation.process_covariance`).

    Options and signals are those of `GaussianFilter`. Defaults [ours]: QN of white noise of density 0.01 in every
    state, RN = 1e-4, P = I at the start.

    Args:
        model: name of an observer model or of a plant, or one itself. options: those of `GaussianFilter`.

    Raises:
        ValueError: the model is unknown, or a mode of an observer model does not decay and is not measured.
    """

    name = "extended_kalman_filter"
    description = "Extended Kalman filter"
    source = "Allaoui 2024, (2.25)-(2.31); Bouchama 2024, section 1.3"

    def __init__(self, model: Source = "pendulum", **options: Any) -> None:
        if isinstance(model, ObserverModel) or (model in MODELS and not options.get("outputs")):
            model = find_model(model)
            require_detectable_model(model, self.name)
        super().__init__(model, **options)

    def predicted(self, belief: Belief, known: Known, period: Array, noise: Array, p: Any) -> Belief:
        F, W = self.model.transition_jacobians(belief.estimate, known, period)
        moved = self.model.moved(belief.estimate, self.model.no_noise(), known, period)
        if self.rooted:
            root = square_root.factor(noise)
            return Belief(moved, square_root.predicted_factor(belief.spread, F, root if W is None else W @ root))
        return Belief(moved, kalman.predicted_covariance(belief.spread, F, noise, W))

    def corrected(
        self, belief: Belief, known: Known, y: Array, rows: Sequence[int], noise: Array, p: Any
    ) -> tuple[Corrected, Array]:
        chosen = list(rows)
        H, V = self.model.measurement_jacobians(belief.estimate, known)
        expected = self.model.measured(belief.estimate, self.model.no_reading_noise(), known)[chosen]
        there = is_there(y)
        rows_there = there.reshape(there.shape[0], 1)
        innovation, H = or_else(y, expected) - expected, H[chosen] * rows_there
        if self.form == "square_root":
            if V is None:
                entry = square_root.factor(kalman.decoupled(noise[chosen][:, chosen], there))
            else:
                entry = np.hstack([V[chosen] @ square_root.factor(noise) * rows_there, np.diag(1.0 - there)])
            return square_root.correct_factor(belief.estimate, belief.spread, innovation, H, entry), innovation
        own = noise[chosen][:, chosen] if V is None else kalman.through(noise, V[chosen])
        own = kalman.decoupled(own, there)
        return kalman.correct(belief.estimate, belief.spread, innovation, H, own, None, self.form), innovation


class KalmanFilter(ExtendedKalmanFilter):
    """Kalman filter: Allaoui 2024, (2.1)-(2.24); Bouchama 2024, (1.33) and figure 1.1.

    Prediction ``xh(k|k-1) = A_d xh + B_d u``, ``P(k|k-1) = A_d P A_d' + QN``; correction with P(k|k) in the chosen
    form. Of an observer model A_d and B_d are the exact zero-order-hold discretisation at `sample_period`. The signals
    are those of the extended filter, whose Jacobian is A_d here. Its condition is exact: with a stabilising solution of
    the Riccati equation P converges to it from any start.

    Args:
        model: name of an observer model or of a plant, or one itself. options: those of `GaussianFilter`.

    Raises:
        ValueError: the model is nonlinear, or a mode of it does not decay and is not measured.
    """

    name = "kalman_filter"
    description = "Kalman filter of a linear model"
    source = "Allaoui 2024, (2.1)-(2.24); Bouchama 2024, (1.33)"

    def __init__(self, model: Source = "linear_pendulum", **options: Any) -> None:
        super().__init__(model, **options)
        if not self.model.linear:
            raise ValueError(
                f"{self.name}: model {self.model.name!r} is nonlinear: its transition or its measurements are not "
                "affine in the state. Use 'extended_kalman_filter', or linearise it."
            )
