"""What a filter believes, and what moves it: prediction and correction with an FMU as the model. Formulas come from
`fmu_observer.formulas.filtering`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf

from cosim.fmu_model.exchange import ExchangeModel
from cosim.fmu_model.linearise import right_slopes
from cosim.fmu_model.sealed import SealedModel
from fmu_observer.formulas.filtering import kalman, unscented
from fmu_observer.formulas.filtering.square_root import factor

Array = NDArray[np.float64]
SHARE = 1e-4
"""Step of a difference, as a share of the standard deviation of the state: the slope is that near the estimate."""
LEAST = 1e-7
"""The same as a share of the state's value or nominal size: a shorter step drowns in rounding."""


@dataclass(frozen=True, eq=False)
class FmuBelief:
    """Estimate and covariance.

    Attributes:
        x: estimate of the states, shape (n,). P: covariance, shape (n, n).
        nis: normalised square of the last innovation, NaN before the first. degrees: how many values it had.
        count: samples taken in, and steps made, so that random numbers do not repeat.
        points: members, shape (n, N). weights: of them, shape (N,). None where the filter has none.
        states: saved states of the FMU, one a member.
    """

    x: Array
    P: Array
    nis: float = 0.0
    degrees: int = 0
    count: int = 0
    points: Array | None = None
    weights: Array | None = None
    states: tuple[Any, ...] = ()


@dataclass(frozen=True, eq=False)
class Noises:
    """Noises of the model.

    Attributes:
        intensity: covariance that a second adds to the states, shape (n, n).
        inputs: covariance of the inputs, held over a step, shape (m, m).
    """

    intensity: Array
    inputs: Array


class FmuFilter(ABC):
    """One kind of filter over an FMU.

    Args:
        model: the FMU, whose states can be written. noises: of it.
    """

    def __init__(self, model: SealedModel, noises: Noises) -> None:
        self.model, self.noises = model, noises
        self._sizes = np.array([model.nominal(name) for name in model.states])
        self._noisy = np.flatnonzero(np.diagonal(noises.inputs) > 0.0)

    def begin(self, x: Array, P: Array) -> FmuBelief:
        """The belief at the start.

        Args:
            x: estimate, shape (n,). P: covariance, shape (n, n).
        """
        return FmuBelief(x, P)

    @abstractmethod
    def predict(self, belief: FmuBelief, t: float, h: float, u: Array) -> FmuBelief:
        """The belief a step later.

        Args:
            belief: at the begin of the step. t: begin [s]. h: length [s]. u: inputs, held, shape (m,).
        """

    @abstractmethod
    def correct(self, belief: FmuBelief, t: float, u: Array, seen: Sequence[int], y: Array, R: Array) -> FmuBelief:
        """The belief after a measurement.

        Args:
            belief: before it. t: instant [s]. u: inputs, shape (m,).
            seen: which outputs of the model were measured. y: their values, shape (k,). R: covariance, shape (k, k).
        """

    def outputs(self, belief: FmuBelief, t: float, u: Array) -> Array:
        """Outputs of the model at the estimate, shape (q,).

        Args:
            belief: what is believed. t: instant [s]. u: inputs, shape (m,).
        """
        return self.model.outputs_at(t, belief.x.reshape(-1, 1), u)[:, 0]

    def _steps(self, belief: FmuBelief) -> Array:
        deviations = np.sqrt(np.maximum(belief.P.diagonal(), 0.0))
        return np.asarray(np.maximum(SHARE * deviations, LEAST * np.maximum(np.abs(belief.x), self._sizes)))

    def _corrected(self, belief: FmuBelief, found: kalman.Corrected, innovation: Array) -> FmuBelief:
        nis = float(kalman.normalised_square(innovation, found.innovation_covariance))
        counted = belief.count + 1
        return FmuBelief(found.estimate, found.covariance, nis, len(innovation), counted)

    def _from_inputs(self, t: float, h: float, x: Array, u: Array) -> Array:
        """Covariance that the noises of the inputs add over a step, shape (n, n), by central differences."""
        if not len(self._noisy):
            return np.zeros((len(x), len(x)))
        columns = []
        for i in self._noisy:
            size = np.zeros(len(u))
            size[i] = 0.1 * np.sqrt(self.noises.inputs[i, i])
            ends = [self.model.transition(t, h, x, u + sign * size)[0] for sign in (1.0, -1.0)]
            columns.append((ends[0] - ends[1]) / (2.0 * size[i]))
        W = np.array(columns).T.reshape(len(x), len(self._noisy))
        return np.asarray(kalman.through(self.noises.inputs[np.ix_(self._noisy, self._noisy)], W))


class ExtendedFilter(FmuFilter):
    """Extended Kalman filter.

    Slopes come from the directional derivatives of a model exchange FMU where they are right, which is seen by
    differences at the start; else from central differences of whole steps, over a small share of what is not known.

    Args:
        model: the FMU. noises: of it.
    """

    def __init__(self, model: SealedModel, noises: Noises) -> None:
        super().__init__(model, noises)
        self._directional = model if isinstance(model, ExchangeModel) and right_slopes(model) else None

    def predict(self, belief: FmuBelief, t: float, h: float, u: Array) -> FmuBelief:
        """The belief a step later; arguments as for `FmuFilter`."""
        x, steps = belief.x, self._steps(belief)
        sloped = None if self._directional is None else self._directional.transition_with_slope(t, h, x, u)
        if sloped is not None:
            moved, F = sloped
            P = kalman.predicted_covariance(belief.P, F, h * self.noises.intensity) + self._from_inputs(t, h, x, u)
            return replace(belief, x=moved, P=P, count=belief.count + 1)
        points, apart = _about(x, steps)
        ends = self.model.states_after(t, h, points, u)
        F = _slopes(ends, apart)
        P = kalman.predicted_covariance(belief.P, F, h * self.noises.intensity)
        if len(self._noisy):
            P = P + self._from_inputs(t, h, x, u)
        return FmuBelief(ends[:, 0].copy(), P, belief.nis, belief.degrees, belief.count + 1)

    def correct(self, belief: FmuBelief, t: float, u: Array, seen: Sequence[int], y: Array, R: Array) -> FmuBelief:
        """The belief after a measurement; arguments as for `FmuFilter`."""
        x, steps = belief.x, self._steps(belief)
        chosen = list(seen)
        if self._directional is not None:
            expected = self.model.values_at(t, x, u)[1][chosen]
            slopes = self._directional.slopes([self.model.outputs[i] for i in chosen])
            return self._corrected(belief, kalman.correct(x, belief.P, y - expected, slopes, R), y - expected)
        points, apart = _about(x, steps)
        readings = self.model.outputs_at(t, points, u, chosen)
        innovation = y - readings[:, 0]
        return self._corrected(belief, kalman.correct(x, belief.P, innovation, _slopes(readings, apart), R), innovation)


class UnscentedFilter(FmuFilter):
    """Unscented Kalman filter: sigma points through whole steps, drawn anew before each measurement.

    Args:
        model: the FMU. noises: of it. alpha: spread of the points [1].
    """

    def __init__(self, model: SealedModel, noises: Noises, alpha: float) -> None:
        super().__init__(model, noises)
        self._weights = unscented.weights(len(model.states), alpha)

    def predict(self, belief: FmuBelief, t: float, h: float, u: Array) -> FmuBelief:
        """The belief a step later; arguments as for `FmuFilter`."""
        w = self._weights
        points = unscented.sigma_points(belief.x, _root(belief.P), w.spread)
        found = _scattered(self.model.states_after(t, h, points, u))
        x, P = unscented.moments(found, w)
        P = P + h * self.noises.intensity
        if len(self._noisy):
            P = P + self._from_inputs(t, h, belief.x, u)
        return FmuBelief(x, P, belief.nis, belief.degrees, belief.count + 1)

    def correct(self, belief: FmuBelief, t: float, u: Array, seen: Sequence[int], y: Array, R: Array) -> FmuBelief:
        """The belief after a measurement; arguments as for `FmuFilter`."""
        w, chosen = self._weights, list(seen)
        points = unscented.sigma_points(belief.x, _root(belief.P), w.spread)
        states, readings = _scattered(points), _scattered(self.model.outputs_at(t, points, u, chosen))
        found = unscented.correct(belief.x, belief.P, states, readings, y, R, w)
        return self._corrected(belief, found, y - unscented.mean(readings, w))


def _about(x: Array, steps: Array) -> tuple[Array, Array]:
    """A state and both its neighbours along each axis, shape (n, 2 n + 1), and how far these are apart, shape (n,)."""
    n = len(x)
    points = np.repeat(x, 2 * n + 1).reshape(n, 2 * n + 1)
    above, below = x + steps, x - steps
    points[:, 1 : n + 1].flat[:: n + 1], points[:, n + 1 :].flat[:: n + 1] = above, below
    return points, above - below


def _slopes(values: Array, apart: Array) -> Array:
    """Central differences of values at the points of `_about`, shape (k, n)."""
    n = len(apart)
    return np.asarray((values[:, 1 : n + 1] - values[:, n + 1 :]) / apart)


def _scattered(values: Array) -> unscented.Scattered:
    """Values at sigma points, the centre first."""
    return unscented.Scattered(values[:, 0], values[:, 1:] - values[:, :1])


def _root(P: Array) -> Array:
    """Lower factor of a covariance; the quick one of a library where nothing is known exactly."""
    lower, failed = dpotrf(P, lower=1)  # a fifth of the time of np.linalg.cholesky
    return np.asarray(factor(P) if failed else lower)
