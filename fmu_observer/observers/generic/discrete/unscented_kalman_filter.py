"""The unscented Kalman filter, with and without redrawing, in full and in square-root form."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar, NamedTuple

import numpy as np

from fmu_observer.formulas.filtering import unscented
from fmu_observer.formulas.filtering.kalman import Corrected, decoupled, symmetric
from fmu_observer.formulas.filtering.square_root import factor
from fmu_observer.formulas.filtering.unscented import Scattered, Weights
from fmu_observer.models.filter_models import Known
from fmu_observer.models.traced_system_model import Source
from fmu_observer.observers.generic.discrete.filter_signals import Belief
from fmu_observer.observers.generic.discrete.gaussian_filter import Form, GaussianFilter
from plant_models.hybrid import Array, parameter
from plant_models.hybrid.missing import is_there, or_else

_ALPHA, BETA, _KAPPA = 1e-3, 2.0, 0.0  # Allaoui 2024, section II.6


class _Drawn(NamedTuple):
    """Points that moved, and the factor of the process noise that was added to their covariance."""

    points: Scattered
    unseen: Array


class UnscentedKalmanFilter(GaussianFilter):
    """Unscented Kalman filter: Allaoui 2024, (2.40)-(2.55).

    At a sample 2 n + 1 points are drawn from (xh, P), each moves by the model over one period, and their weighted mean
    and covariance with QN are the prediction. Points for the measurement are drawn again from the prediction (2.46)-
    (2.48), or, with ``redraw = False``, are those that moved, as in the boxed algorithm of section II.6.3. Noise
    through declared inputs of the model is drawn along with the state (2 (n + r) + 1 points). Means are taken as
    ``chi_0 + sum Wm (chi - chi_0)`` and covariances likewise, so that alpha = 1e-3 costs no digits.

    Options and signals are those of `GaussianFilter`, and `alpha`, `beta`, `kappa` are parameters. Defaults [ours]: QN
    of white noise of density 0.01 in every state, RN = 1e-4, P = I at the start.

    Args:
        model: see `GaussianFilter`. redraw: whether points are drawn again for the measurement.
        options: those of `GaussianFilter`.
    """

    name = "unscented_kalman_filter"
    description = "Unscented Kalman filter"
    source = "Allaoui 2024, (2.32)-(2.55)"
    forms: ClassVar[tuple[Form, ...]] = ("short", "square_root")
    own_parameters = (
        parameter("alpha", "1", _ALPHA, "Spread of the sigma points", min=1e-6),
        parameter("beta", "1", BETA, "What is known of the distribution, 2 for a Gaussian one"),
        parameter("kappa", "1", _KAPPA, "Second spread of the sigma points, 0 or 3 - n"),
    )
    option_choices = {
        **GaussianFilter.option_choices,
        "form": ("short", "square_root"),
        "redraw": (True, False),
    }

    def __init__(self, model: Source = "pendulum", *, redraw: bool = True, **options: Any) -> None:
        self.redraw = redraw
        super().__init__(model, redraw=redraw, **options)
        if not redraw and self.model.measurement_noises:
            raise ValueError(
                f"{self.name}: redraw = False leaves no points for {self.model.measurement_noises[0].name!r}; use "
                "redraw = True, or additive measurement noise."
            )

    def requirements(self, p: Any) -> dict[str, Array]:
        """Covariances are positive, and the weights exist."""
        needed = super().requirements(p)
        needed["kappa must be above minus the number of states"] = np.where(self.model.order + p.kappa > 0.0, 1.0, 0.0)
        if self.rooted:
            fits = np.where(p.beta >= p.alpha * p.alpha, 1.0, 0.0)
            needed["beta must be at least alpha squared in the square-root form: alpha and beta"] = fits
        return needed

    def unmoved(self, belief: Belief, p: Any) -> Belief:
        """The start, with points drawn from it where they are used again."""
        if self.redraw:
            return belief
        n, inputs = self.model.order, len(self.model.process_noises)
        root = _blocks(self._root(belief.spread), np.zeros((inputs, inputs)))
        centre = np.hstack([belief.estimate, self.model.no_noise()])
        points = unscented.sigma_points(centre, root, self._weights(inputs, p).spread)
        return belief._replace(drawn=_Drawn(unscented.scattered(lambda at: at[:n], points), np.zeros((n, n))))

    def predicted(self, belief: Belief, known: Known, period: Array, noise: Array, p: Any) -> Belief:
        n, inputs = self.model.order, len(self.model.process_noises)
        w, root = self._weights(inputs, p), self._root(belief.spread)
        centre = np.hstack([belief.estimate, self.model.no_noise()])
        spread = _blocks(root, factor(noise)) if inputs else root
        found = unscented.scattered(
            lambda at: self.model.moved(at[:n], at[n:], known, period), unscented.sigma_points(centre, spread, w.spread)
        )
        added = np.zeros((n, n)) if inputs else noise
        if self.rooted:
            after = unscented.predicted_root(found, factor(added), w)
        else:
            after = symmetric(unscented.covariance(found, found, w)) + added
        return Belief(unscented.mean(found, w), after, None if self.redraw else _Drawn(found, factor(added)))

    def corrected(
        self, belief: Belief, known: Known, y: Array, rows: Sequence[int], noise: Array, p: Any
    ) -> tuple[Corrected, Array]:
        chosen, n, inputs = list(rows), self.model.order, len(self.model.measurement_noises)
        unseen = None
        if belief.drawn is None:
            w, spread = self._weights(inputs, p), self._root(belief.spread)
            centre = np.hstack([belief.estimate, self.model.no_reading_noise()])
            points = unscented.sigma_points(centre, _blocks(spread, factor(noise)) if inputs else spread, w.spread)
        else:
            w, unseen = self._weights(len(self.model.process_noises), p), belief.drawn.unseen
            centre = belief.drawn.points.centre.reshape(n, 1)
            points = np.hstack([centre, centre + belief.drawn.points.deviations])
        seen = unscented.scattered(lambda at: self.model.measured(at[:n], at[n:], known)[chosen], points)
        there = is_there(y)
        seen = seen._replace(deviations=seen.deviations * there.reshape(len(chosen), 1))
        states = unscented.scattered(lambda at: at[:n], points)
        added = decoupled(np.zeros((len(chosen), len(chosen))) if inputs else noise[chosen][:, chosen], there)
        expected = unscented.mean(seen, w)
        y = or_else(y, expected)
        innovation = y - expected
        if self.rooted:
            after = unscented.correct_root(belief.estimate, states, seen, y, factor(added), w, unseen)
        else:
            after = unscented.correct(belief.estimate, belief.spread, states, seen, y, added, w)
        return after, innovation

    # -- internals --------------------------------------------------------------------------------------------------

    def _root(self, spread: Array) -> Array:
        return spread if self.rooted else factor(spread)

    def _weights(self, noises: int, p: Any) -> Weights:
        return unscented.weights(self.model.order + noises, p.alpha, p.beta, p.kappa)


def _blocks(one: Array, other: Array) -> Array:
    """Two factors as one of both numbers together."""
    n, r = one.shape[0], other.shape[0]
    return np.vstack([np.hstack([one, np.zeros((n, r))]), np.hstack([np.zeros((r, n)), other])])
