"""Least squares on any simulation: estimates, confidence regions and what is not identified. Arrays in, a fit out;
knows no FMU and no file.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from cosim.calibration.noise_model import noise_of

Array = NDArray[np.float64]

Simulation = Callable[[Array], Array]
"""Parameters of several runs, shape (m, p), to their signals, shape (m, q, n)."""

_DIFFERENCE = 1e-4
"""Step of central differences, as a share of a parameter's size: a solver in the simulation may round at 1e-9."""
_UNSEEN = 1e12
"""Variance, in squared sizes of the parameters, of a direction that no signal shows."""
_REPEATS = 3  # the noise is estimated anew after each fit


def _serial_correlation(residuals: Array) -> float:
    """Correlation of neighbouring residuals.

    Args:
        residuals: shape (n,).
    """
    squares = float(np.sum(residuals**2))
    return float(np.sum(residuals[1:] * residuals[:-1])) / squares if squares > 0.0 else 0.0


@dataclass(frozen=True, eq=False)
class Fit:
    """Parameters of a simulation that comes nearest to measured signals.

    Attributes:
        parameters: estimates, shape (p,). covariance: of them, shape (p, p).
        sizes: sizes of the parameters by which directions are compared, shape (p,).
        residuals: measured less simulated, shape (q, n). noise: their standard deviations, shape (q,).
        correlation: of neighbouring residuals, shape (q,). samples_per_independent: see `Noise`, shape (q,).
        jacobian: of the signals by the parameters, shape (q, n, p).
        freedom: samples less parameters. runs: simulations that it took. converged: whether it came to rest.
    """

    parameters: Array
    covariance: Array
    sizes: Array
    residuals: Array
    noise: Array
    correlation: Array
    samples_per_independent: Array
    jacobian: Array
    freedom: int
    runs: int
    converged: bool

    @property
    def condition(self) -> float:
        """Condition number of the Jacobian over the noise, each column scaled to length 1."""
        columns = (self.jacobian / np.where(self.noise > 0.0, self.noise, 1.0)[:, None, None]).reshape(
            -1, len(self.sizes)
        )
        lengths = np.linalg.norm(columns, axis=0)
        return float(np.linalg.cond(columns / np.where(lengths > 0.0, lengths, 1.0)))

    def half_widths(self, level: float) -> Array:
        """Half of the confidence intervals, one parameter at a time, shape (p,).

        Args:
            level: probability that an interval covers the true value, between 0 and 1.
        """
        quantile = float(scipy.special.stdtrit(self.freedom, 0.5 + 0.5 * level))
        return np.asarray(quantile * np.sqrt(np.diagonal(self.covariance)))

    def covers(self, truth: Array, level: float) -> bool:
        """Whether the joint confidence region, an ellipsoid, holds a point.

        Args:
            truth: the point, shape (p,). level: probability of the region, between 0 and 1.
        """
        count = len(self.parameters)
        away = (truth - self.parameters) / self.sizes
        scaled = self.covariance / np.outer(self.sizes, self.sizes)
        distance = float(away @ np.linalg.pinv(scaled, hermitian=True) @ away)
        return distance <= count * float(scipy.special.fdtri(count, self.freedom, level))


def fit(
    simulate: Simulation,
    start: Array,
    measured: Array,
    *,
    noise: Array | None = None,
    sizes: Array | None = None,
    low: Array | None = None,
    high: Array | None = None,
) -> Fit:
    """Fit a simulation to measured signals by least squares on residuals divided by the noise.

    Derivatives are central differences. The covariance is that of the Jacobian with the noise that the residuals show,
    see `noise_of`.

    Args:
        simulate: the signals of runs, shape (m, q, n), for parameters of shape (m, p).
        start: first guess, shape (p,). measured: shape (q, n), with NaN where nothing was measured.
        noise: standard deviations of the measurements, shape (q,), which weigh the signals; None: estimated.
        sizes: typical sizes of the parameters, shape (p,), all positive; None for those of the start, 1 where that is
            0. low, high: bounds, shape (p,); None for none.

    Raises:
        ValueError: the simulation at the start gives no finite number.
        NoSlopeError: simulations on both sides of a point give none.
    """
    sizes = np.where(start != 0.0, np.abs(start), 1.0) if sizes is None else sizes
    residuals = _Residuals(simulate, measured, sizes, low, high)
    if not np.isfinite(residuals(start)).all():
        raise ValueError("the simulation at the start of the fit gives values that are no finite numbers")
    return _fit(residuals, start, noise)


class NoSlopeError(ValueError):
    """A fit cannot go on: simulations beside a point that it has reached give no finite numbers.

    Attributes:
        parameters: where it stands, shape (p,). which: numbers of the parameters whose slope is not known.
    """

    def __init__(self, parameters: Array, which: list[int]) -> None:
        super().__init__("the simulations beside the point that a fit has reached give no finite numbers")
        self.parameters, self.which = parameters, which


class _Residuals:
    """Measured less simulated signals by the parameters, shape (q, n), zero where nothing was measured; counts runs."""

    def __init__(
        self, simulate: Simulation, measured: Array, sizes: Array, low: Array | None, high: Array | None
    ) -> None:
        self._simulate, self._measured, self.sizes, self._low, self._high = simulate, measured, sizes, low, high
        self.known, self.runs = np.isfinite(measured), 0

    def __call__(self, parameters: Array) -> Array:
        return np.asarray(self._several(parameters[None])[0])

    def _several(self, points: Array) -> Array:
        """Residuals with each of the parameters, shape (m, q, n)."""
        self.runs += len(points)
        with np.errstate(all="ignore"):
            return np.where(self.known, self._measured - self._simulate(points), 0.0)

    def jacobian(self, parameters: Array) -> Array:
        """Derivatives by central differences inside the bounds, shape (q, n, p); by one side where the run on the other
        one gives no numbers.

        Raises:
            NoSlopeError: the runs on both sides of a parameter give no numbers.
        """
        steps = _DIFFERENCE * np.maximum(np.abs(parameters), self.sizes)
        low, high = self.bounds
        above = np.minimum(parameters + steps, high * self.sizes)
        below = np.maximum(parameters - steps, low * self.sizes)
        moves = np.array([above - parameters, below - parameters])
        found = self._several(np.concatenate([parameters + np.diag(move) for move in moves]))
        found = found.reshape(2, len(steps), *found.shape[1:])
        lost = ~np.isfinite(found).all(axis=(2, 3))
        if lost.any():
            if lost.all(axis=0).any():
                raise NoSlopeError(parameters, np.flatnonzero(lost.all(axis=0)).tolist())
            found[lost], moves[lost] = self(parameters), 0.0
        return np.moveaxis((found[0] - found[1]) / (moves[0] - moves[1])[:, None, None], 0, -1)

    @property
    def bounds(self) -> tuple[Array, Array]:
        """In sizes of the parameters, shape (p,) each."""
        count = len(self.sizes)
        return (
            np.full(count, -np.inf) if self._low is None else self._low / self.sizes,
            np.full(count, np.inf) if self._high is None else self._high / self.sizes,
        )

    @property
    def spreads(self) -> Array:
        """Standard deviations of the measured signals, of what is constant its size, shape (q,)."""
        rows = [row[k] for row, k in zip(self._measured, self.known, strict=True)]
        return np.array([np.std(row) or np.abs(row).max() or 1.0 if len(row) else 1.0 for row in rows])


def _fit(residuals: _Residuals, start: Array, noise: Array | None) -> Fit:
    known, sizes, spreads = residuals.known, residuals.sizes, residuals.spreads
    weights = 1.0 / (spreads if noise is None else noise)
    found, converged = start / sizes, False
    for _ in range(1 if noise is not None or len(known) == 1 else _REPEATS):
        found, converged = _weighted(residuals, found, weights)
        left = residuals(found * sizes)
        if noise is None:
            weights = 1.0 / np.maximum(_deviations(left, known), 1e-12 * spreads)
    left, slopes = residuals(parameters := found * sizes), -residuals.jacobian(parameters)
    rows = zip(left, slopes * sizes, known, strict=True)
    shown = [noise_of(row[there], slope[there]) for row, slope, there in rows]
    return Fit(
        parameters,
        _covariance(slopes * sizes, weights, np.array([noise.spread for noise in shown])) * np.outer(sizes, sizes),
        sizes,
        left,
        np.array([noise.deviation for noise in shown]),
        np.array([_serial_correlation(row[there]) for row, there in zip(left, known, strict=True)]),
        np.array([noise.samples_per_independent for noise in shown]),
        slopes,
        max(1, int(known.sum()) - len(start)),
        residuals.runs,
        converged,
    )


def _weighted(residuals: _Residuals, found: Array, weights: Array) -> tuple[Array, bool]:
    """Parameters in their sizes for the least weighted squares, from a guess on, shape (p,); whether it converged."""
    sizes = residuals.sizes
    result = scipy.optimize.least_squares(
        lambda z: np.nan_to_num((residuals(z * sizes) * weights[:, None]).ravel(), nan=1e9),
        np.clip(found, *residuals.bounds),
        jac=lambda z: (residuals.jacobian(z * sizes) * weights[:, None, None] * sizes).reshape(-1, len(found)),
        bounds=residuals.bounds,
        x_scale="jac",
        xtol=1e-10,
    )
    return result.x, bool(result.success)


def _deviations(residuals: Array, known: NDArray[np.bool_]) -> Array:
    """Standard deviations of the residuals, shape (q,)."""
    return np.asarray(np.sqrt(np.sum(residuals**2, axis=1) / np.maximum(known.sum(axis=1), 1)))


def _covariance(slopes: Array, weights: Array, spreads: Array) -> Array:
    """Covariance of weighted least squares, shape (p, p), for slopes, shape (q, n, p), and the covariances of ``J'
    noise`` of each signal, shape (q, p, p); infinite directions are made very wide, not lost.
    """
    weights = weights * 2.0 ** -np.floor(np.log2(weights.max()))  # which the result does not depend on
    normal = np.einsum("qni,qnj,q->ij", slopes, slopes, weights**2)
    values, vectors = np.linalg.eigh(normal)
    shown = values > np.finfo(float).eps * max(float(values[-1]), np.finfo(float).tiny)
    inverse = (vectors[:, shown] / values[shown]) @ vectors[:, shown].T
    hidden = vectors[:, ~shown]
    spread = np.einsum("qij,q->ij", spreads, weights**4)
    return np.asarray(inverse @ spread @ inverse + _UNSEEN * hidden @ hidden.T)


@dataclass(frozen=True)
class _Direction:
    """A common change of parameters that the signals show too little of.

    Attributes:
        shares: change of each parameter by name, relative to its size, the largest 1; small ones are left out.
        uncertainty: standard deviation along it, relative to the sizes of the parameters.
    """

    shares: dict[str, float]
    uncertainty: float

    def explain(self) -> str:
        """The direction in words."""
        names = list(self.shares)
        if len(names) == 1:
            return (
                f"{names[0]} cannot be found from these signals (uncertain by {100.0 * self.uncertainty:.3g} % of its "
                "size)"
            )
        changes = ", ".join(f"{name} {100.0 * share:+.0f} %" for name, share in self.shares.items())
        text = f"a common change of {changes} hardly shows (uncertain by {100.0 * self.uncertainty:.3g} %)"
        if len(names) == 2 and abs(abs(self.shares[names[1]] / self.shares[names[0]]) - 1.0) < _RATIO:
            one, other = names
            alike = self.shares[one] * self.shares[other] > 0.0
            text += f": only the {'ratio' if alike else 'product'} of {one} and {other} is identified"
        return text


_RATIO = 0.1
"""Two shares within this count as equal, so that a ratio or a product is named."""
_SMALL = 0.05
"""Shares below this are left out of the words."""


def unseen_directions(found: Fit, names: Sequence[str], limit: float) -> list[_Direction]:
    """Directions in which the parameters are not identified: the long axes of the confidence ellipsoid.

    Args:
        found: the fit. names: of the parameters. limit: standard deviation relative to the sizes of the parameters
            beyond which a direction counts as not identified.

    Returns:
        The directions, the worst first.
    """
    size = np.where(found.parameters != 0.0, np.abs(found.parameters), found.sizes)
    values, vectors = np.linalg.eigh(found.covariance / np.outer(size, size))
    directions = []
    for value, vector in zip(values[::-1], vectors.T[::-1], strict=True):
        deviation = float(np.sqrt(max(value, 0.0)))
        if not deviation > limit:
            break
        turned = vector / vector[np.argmax(np.abs(vector))]
        shares = {name: float(s) for name, s in zip(names, turned, strict=True) if abs(s) >= _SMALL}
        directions.append(_Direction(shares, deviation))
    return directions
