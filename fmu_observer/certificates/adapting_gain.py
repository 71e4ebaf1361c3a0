"""Certificate of a high gain that follows the train's speed: one Lyapunov function for all gaps, gains and changes of
gain.

In units of the gain in force, ``eps = (e_p, e_v / theta)``, a gap of length g is the transition Phi(theta g) of the
gain 1. At a balise the gain changes, and eps_2 with it. What combinations of ``x = theta g`` and
``m = theta_k / theta_(k+1)`` can occur follows from bounds on speed, acceleration and spacing. It uses the transitions
of `sampled_error` and the candidates of `quadratic`, and believes only what it recomputes. Ours; the thesis has
constant gains only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, reduce
from math import inf, sqrt

import numpy as np

from fmu_observer.certificates.bisection import bisected
from fmu_observer.certificates.finding import Finding
from fmu_observer.certificates.gap_error import first_unstable_gap, rows_of
from fmu_observer.certificates.gap_findings import gap_finding
from fmu_observer.certificates.quadratic import (
    Decrease,
    QuadraticCondition,
    best_decrease,
    flow_condition,
    inequalities,
    transition_condition,
)
from fmu_observer.certificates.sampled_error import SampledError

_CELLS = 800  # of x, for checking
_COARSE = 16  # values of x for finding the Lyapunov matrix
_CUTS = 5
_LONGEST_X = 20.0  # theta times gap up to which a constant gap is searched for instability
_LIMIT_TOLERANCE = 1e-3  # relative width of the last bisection interval
_SMALLEST_LIMIT = 1e-5  # of the constant limit: below it no gap was found


@dataclass(frozen=True)
class GainAdaptation:
    """``theta = clip(ratio v / d, theta_min, theta_max)`` at each balise, and what is assumed of train and track;
    hashable.

    Attributes:
        ratio: theta times the gap that is expected [1]. theta_min, theta_max: limits of the gain [1/s].
        spacing: expected spacing d [m].
        high_gain: shape K, shape (2,).
        drag_slopes: smallest and largest slope of the running resistance over mass [1/s].
        acceleration: largest acceleration and deceleration of the train [m/s2].
        speed_tolerance: largest relative error of the speed that theta is computed from, at most 1 [1].
        spacing_tolerance: largest relative difference between a spacing and the expected one, below 1 [1].
        learnt: whether d is a spacing measured earlier, which may be off to one side while the next is off to the
        other.
    """

    ratio: float
    theta_min: float
    theta_max: float
    spacing: float
    high_gain: tuple[float, float]
    drag_slopes: tuple[float, float]
    acceleration: float
    speed_tolerance: float = 0.0
    spacing_tolerance: float = 0.0
    learnt: bool = False

    @cached_property
    def vertices(self) -> tuple[SampledError, ...]:
        """Error of gain 1 with the drag slopes in its units of time: the smallest, the mean and the largest."""
        slowest, fastest = self.drag_slopes[0] / self.theta_max, self.drag_slopes[1] / self.theta_min
        slopes = sorted({slowest, 0.5 * (slowest + fastest), fastest})
        return tuple(SampledError.of([[0.0, 1.0], [0.0, -s]], self.high_gain, self.high_gain[0]) for s in slopes)

    def constant_speed_x(self, gap: float) -> float:
        """Theta times gap at a constant speed and the expected spacing [1]."""
        return min(max(self.ratio, self.theta_min * gap), self.theta_max * gap)

    def slowest_speed(self, max_gap: float) -> float:
        """Speed [m/s] below which the longest spacing takes longer than `max_gap` [s]; assumed everywhere."""
        return self.spacing * (1.0 + self.spacing_tolerance) / max_gap

    def expected_share(
        self, shortest: np.ndarray, longest: np.ndarray, max_gap: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Smallest and largest ``v g / d``, speed at either end of a gap g, over all gaps from `shortest` to `longest`.

        The smallest is reached by a train that gains speed all the way (or stays at the slowest speed), the largest by
        one that loses it until it has the slowest speed. Both are unimodal in g, so ends and turning point give the
        extremes.

        Args:
            shortest, longest: [s], shape (count,). max_gap: longest gap of all [s].

        Returns:
            Two arrays of shape (count,), errors of the measured speed and of a learnt d included.
        """
        v, a, d = self.slowest_speed(max_gap), self.acceleration, self.spacing
        near, far = d * (1.0 - self.spacing_tolerance), d * (1.0 + self.spacing_tolerance)
        turn = np.clip(_time_for(near, v, a), shortest, longest)
        low = np.maximum(near - 0.5 * a * turn**2, v * turn) / d
        root = (sqrt(v * v + 6.0 * a * far) - v) / 3.0
        peak = np.clip(max(_time_for(far, v, a), (far - 0.5 * root**2 / a) / v) if a > 0.0 else inf, shortest, longest)
        braking = far + 0.5 * a * peak**2  # end speed still above the slowest
        crawling = (v + np.sqrt(2.0 * a * np.maximum(far - v * peak, 0.0))) * peak
        high = np.where(peak <= _time_for(far, v, a), braking, crawling) / d
        widest, narrowest = (1.0 + self.spacing_tolerance, 1.0 - self.spacing_tolerance) if self.learnt else (1.0, 1.0)
        with np.errstate(divide="ignore"):
            return low * (1.0 - self.speed_tolerance) / widest, high * (1.0 + self.speed_tolerance) / np.float64(
                narrowest
            )


@dataclass(frozen=True)
class _Cells:
    """Cells of x and the changes of gain possible in them: x from ``x[i]`` to ``x[i + 1]``, m between `smallest` and
    `largest`.

    Where `changing` is false, the gain is at its upper limit before and after the balise, so that m = 1.
    """

    x: np.ndarray
    changing: np.ndarray
    smallest: np.ndarray
    largest: np.ndarray


def certify_adapting_gain(adaptation: GainAdaptation, max_gap: float, error_model: str) -> Finding:
    """Certificate of an observer whose high gain follows the speed, for gaps up to `max_gap` [s].

    Args:
        adaptation: the rule and what is assumed. max_gap: longest gap asked for [s]. error_model: the error in words.

    Returns:
        What is found about the gaps. Its Lyapunov function is ``theta eps' P eps`` with theta in force.
    """
    horizon = max(2.0 * max_gap, _LONGEST_X / adaptation.theta_min)
    unstable_x = first_unstable_gap(adaptation.vertices, horizon * adaptation.theta_min)
    constant = unstable_x / (adaptation.theta_min if unstable_x > adaptation.ratio else adaptation.theta_max)
    found = _common_decrease(adaptation, max_gap)
    limit = _aperiodic_limit(adaptation, min(constant, horizon))
    x = adaptation.constant_speed_x(max_gap)
    return gap_finding(
        max_gap,
        horizon,
        constant_limit=constant,
        mixed_limit=max(limit, max_gap) if found.holds else limit,
        growth=max(vertex.spectral_radius(x) for vertex in adaptation.vertices),
        decrease=found.margin,
        holds=found.holds,
        error_model=error_model,
        matrix=rows_of(found.P),
    )


@lru_cache(maxsize=64)
def _aperiodic_limit(adaptation: GainAdaptation, bound: float) -> float:
    """Longest gap [s] covered, by bisection: what can occur up to a gap can occur up to every longer one; inf if all
    are.
    """
    if _common_decrease(adaptation, bound).holds:
        return inf

    def covered(longest: float) -> bool:
        return _common_decrease(adaptation, longest).holds

    return bisected(covered, 0.0, bound, width=_LIMIT_TOLERANCE, least=_SMALLEST_LIMIT * bound)[0]


@lru_cache(maxsize=256)
def _common_decrease(adaptation: GainAdaptation, max_gap: float) -> Decrease:
    """Best recomputed relative decrease over everything that can occur up to `max_gap`, and its P."""
    cells = _cells(adaptation, max_gap)
    if cells.changing[0] and (cells.smallest[0] < 1.0 or cells.largest[0] > 1.0):
        return Decrease(-inf, None)  # changes of the gain without any time to correct: nothing here covers them
    grids = [_Grid(vertex, cells) for vertex in adaptation.vertices]
    sought = reduce(QuadraticCondition.joined, (grid.condition(range(0, _CELLS, _CELLS // _COARSE)) for grid in grids))

    def recomputed(P: np.ndarray) -> tuple[float, list[int]]:
        found = [grid.largest(P) for grid in grids]
        return -max(largest for largest, _ in found), sorted({cell for _, cell in found})

    def refined(known: QuadraticCondition, worst: list[int]) -> QuadraticCondition:
        return reduce(QuadraticCondition.joined, (grid.condition(worst) for grid in grids), known)

    return best_decrease(sought, recomputed, refined, _CUTS)


def _cells(adaptation: GainAdaptation, max_gap: float) -> _Cells:
    """What can occur, cell by cell; a superset, since every bound is taken at its worst over the cell."""
    low, high, ratio = adaptation.theta_min, adaptation.theta_max, adaptation.ratio
    everywhere = adaptation.expected_share(np.zeros(1), np.full(1, max_gap), max_gap)[1][0]
    x = np.linspace(0.0, min(max(ratio * everywhere, low * max_gap), high * max_gap), _CELLS + 1)
    longest = np.minimum(x[1:] / low, max_gap)
    smallest_share, largest_share = adaptation.expected_share(np.minimum(x[:-1] / high, longest), longest, max_gap)
    least, most = (np.maximum(ratio * share, np.finfo(float).tiny) for share in (smallest_share, largest_share))
    with np.errstate(over="ignore"):
        drop, rise = np.minimum(x[1:] / least, high / low), np.maximum(x[:-1] / most, low / high)
    return _Cells(x, x[1:] >= ratio * smallest_share, np.minimum(1.0, rise), np.maximum(1.0, drop))


class _Grid:
    """The inequalities of one vertex on the grid of cells, divided by x: at x = 0 that is the condition of the flow."""

    def __init__(self, vertex: SampledError, cells: _Cells) -> None:
        self._x, self._transitions = vertex.transitions(float(cells.x[-1]), _CELLS)  # entry i stands at x[i + 1]
        start = flow_condition(vertex.continuous_limit)
        self._unchanged = start.joined(transition_condition(self._transitions, self._x))
        self._cells = np.flatnonzero(cells.changing & (np.arange(_CELLS) > 0))  # at x = 0 no gain changes
        # the condition is convex in m
        self._changes = np.stack([cells.smallest[self._cells], cells.largest[self._cells]])
        self._first = np.clip(self._cells - 2, 0, _CELLS - 4)  # the cell and its neighbours: four points

    def condition(self, cells: Sequence[int]) -> QuadraticCondition:
        """The inequalities at some of the cells, with the extreme changes of gain possible there."""
        chosen = np.isin(self._cells, np.asarray(cells))
        ends = self._cells[chosen]
        parts = [self._unchanged.picked(cells)]
        parts += [self._changed(ends - 1 + end, change[chosen]) for change in self._changes for end in (0, 1)]
        return reduce(QuadraticCondition.joined, parts)

    def largest(self, P: np.ndarray) -> tuple[float, int]:
        """Largest eigenvalue on the grid with a bound for what lies between its points, and the cell where it is
        largest.
        """
        unchanged = inequalities(self._unchanged, P)
        largest = np.linalg.eigvalsh(unchanged)[:, -1]
        found = (
            float(largest.max()) + 0.125 * _bend(np.diff(unchanged, 2, axis=0)),
            min(int(largest.argmax()), _CELLS - 1),
        )
        for change in self._changes if len(self._cells) else ():
            points = np.stack([inequalities(self._changed(self._first + k, change), P) for k in range(4)])
            here = np.arange(len(self._cells))
            ends = points[self._cells - 1 - self._first, here], points[self._cells - self._first, here]
            largest = np.maximum(*(np.linalg.eigvalsh(end)[:, -1] for end in ends))
            # see aperiodic: bound between grid points
            worst = float(largest.max()) + 0.125 * _bend(np.diff(points, 2, axis=0))
            found = max(found, (worst, int(self._cells[largest.argmax()])))
        return found

    def _changed(self, at: np.ndarray, change: np.ndarray) -> QuadraticCondition:
        """Inequalities of ``theta eps' P eps`` over transitions and the changes ``m = theta_k / theta_(k+1)`` after
        them.
        """
        scale = np.stack([change**-0.5, change**0.5], axis=1)
        return transition_condition(scale[:, :, None] * self._transitions[at], self._x[at])


def _bend(second_differences: np.ndarray) -> float:
    return float(np.linalg.norm(second_differences, axis=(-2, -1)).max())


def _time_for(distance: float, speed: float, acceleration: float) -> float:
    """Time [s] over a distance [m] from a speed [m/s] under constant acceleration [m/s2]; by symmetry also down to that
    speed.
    """
    return 2.0 * distance / (speed + sqrt(speed * speed + 2.0 * acceleration * distance))
