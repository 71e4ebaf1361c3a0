"""One pass of Gauss-Newton over a window, by a sweep forwards and one backwards: fixed cost, linear in the rows. Pure
functions that trace.

About the states of the pass before, the window is a linear least-squares problem with the structure of a chain. It is
solved exactly: forwards by the Kalman filter from the arrival cost on, backwards by the adjoint of Bryson and Frazier,
``lambda = F' ((I - K H)' lambda - H' inv(S) e)``, ``x = m - P lambda`` (Bierman: Factorization methods for discrete
sequential estimation, chapter X). No covariance is inverted, so that states without noise and known ones are legal.

Bounds are kept by a primal-dual active set (Hintermueller, Ito, Kunisch, SIAM J. Optim. 13 (2002) 865): a bound that is
active is a measurement with hardly any noise, whose multiplier the adjoint knows; from pass to pass it is let go where
the multiplier has the wrong sign, and taken up where a state has crossed it. All wrong ones change at once while they
become fewer, else only the one that is wrong by the largest force, so that no set comes back for ever (block pivoting
with a fallback, Judice and Pires, Comput. Oper. Res. 21 (1994) 587; the choice of the one is ours). What a pass returns
is clipped, so that it keeps the bounds after any number of passes. A bound of a disturbance is held alike, on the noise
of a transition before it moves the state. At the end the trajectory is followed once more, each disturbance within its
bounds, and what it then lacks to be a course of the model is reported.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from fmu_observer.formulas.filtering.kalman import correct, predicted_covariance, symmetric
from fmu_observer.formulas.moving_horizon.arrival_cost import ArrivalCost
from fmu_observer.formulas.moving_horizon.robust_loss import weight
from fmu_observer.formulas.moving_horizon.row_window import WindowRow
from fmu_observer.formulas.moving_horizon.window_problem import Limits, Seen, WindowProblem
from plant_models.hybrid import Array, vector
from plant_models.hybrid.scan import Arrays, scan_table


class Solution(NamedTuple):
    """What some passes make of a window.

    Attributes:
        estimates: of each row, shape (N, n). covariance: of the last one, row by row, shape (n * n,).
        residual: root of the mean square of the weighted residuals, in their deviations [1].
        step: largest change of an estimate in the last pass, in its standard deviations [1].
        moved: passes after which an estimate had changed by more than `_SETTLED` of its deviation.
        bounds: bounds that are active in the last row.
        far: measurements that are more than `FAR` of their deviations off, whatever they weigh, and transitions that
            need a disturbance so far off, for each measurement [1].
        broken: largest part of an estimate that the transition into its row and the disturbance found for it do not
            explain, in its standard deviations [1].
    """

    estimates: Array
    covariance: Array
    residual: Array
    step: Array
    moved: Array
    bounds: Array
    far: Array
    broken: Array


KEPT = 8  # problems whose sweeps are known as functions, so that they are traced once
FAR = 5.0  # of a measurement's own deviations: noise is not that far off [ours]
_NEAR = 1e-6  # of its standard deviation: so near a bound a disturbance touches it
_SOFT = 1e-10  # of its variance: what a state may still move where a bound holds it, so that bounds that depend on each
# other share a force, whose sign shows which of them to let go
_COLLAPSED = 1e-6  # of its variance: a state that has less is held by a bound, or known
_SETTLED = 1e-3  # of a standard deviation: a pass that changes less has nothing left to do


def solve(
    problem: WindowProblem, arrival: ArrivalCost, rows: Array, points: Array, shared: Array, passes: int
) -> Solution:
    """A number of Gauss-Newton passes over a window.

    Args:
        problem: what moves and what is measured. arrival: what is known before the first row.
        rows: oldest first, shape (N, width). points: states about which the first pass linearises, shape (N, n); of the
            last row the prediction.
        shared: what all rows share, shape (s,). passes: one or more.
    """
    n, count = problem.order, rows.shape[0]
    active, used = _at_bounds(problem, arrival.point, rows, points, shared), np.zeros(1)
    fewest = np.full(1, np.inf)
    fresh = np.zeros((count, 1))
    fresh[-1] = 1.0
    for _ in range(passes):
        table = (rows, points, active, fresh)
        _, swept = scan_table(_forwards(problem), _begun(arrival, n), table, (shared,))
        behind = (np.zeros(n), np.zeros(4))
        (adjoint, sums), (points, pushes, wanted, wrong) = scan_table(
            _backwards(problem), behind, (*table, *swept), (shared,), backwards=True
        )
        active, fewest = _exchanged(active, wanted, wrong, fewest)
        fresh = np.zeros((count, 1))
        used = used + np.where(sums[1:2] > _SETTLED, 1.0, 0.0)
    before = arrival.mean - np.reshape(arrival.covariance, (n, n)) @ adjoint
    ahead = (arrival.point, before, np.zeros(2))
    (_, _, lacks), (points,) = scan_table(_followed(problem), ahead, (rows, points, pushes, swept[2]), (shared,))
    held = np.reshape(np.sum(np.abs(active[-1])), (1,))
    residual = np.sqrt(sums[0:1] / np.maximum(sums[2:3], 1.0))
    far = (sums[3:4] + lacks[1:2]) / np.maximum(sums[2:3], 1.0)
    return Solution(points, swept[1][-1], residual, sums[1:2], used, held, far, lacks[0:1])


def passed(problem: WindowProblem, arrival: ArrivalCost, row: Array, point: Array, shared: Array) -> ArrivalCost:
    """The arrival cost after a row has left the window.

    Args:
        problem: what moves and what is measured. arrival: before the row. row: the oldest, shape (width,).
        point: its state, shape (n,). shared: what all rows share, shape (s,).
    """
    of_row, at = np.reshape(row, (1, problem.layout.width)), np.reshape(point, (1, problem.order))
    table = (of_row, at, np.zeros((1, max(problem.bounds, 1))), np.zeros((1, 1)))
    (linearised, mean, covariance, _), _ = scan_table(
        _forwards(problem), _begun(arrival, problem.order), table, (shared,)
    )
    return ArrivalCost(linearised, mean, covariance)


def _begun(arrival: ArrivalCost, n: int) -> Arrays:
    """What a sweep begins with: the arrival cost, and the variances of the states where no bound holds them."""
    return (*arrival, vector(*(arrival.covariance[i * (n + 1)] for i in range(n))))


def _exchanged(active: Array, wanted: Array, wrong: Array, fewest: Array) -> tuple[Array, Array]:
    """Bounds that the next pass holds, and the fewest wrong ones so far.

    Args:
        active: held in this pass, shape (N, b). wanted: by the signs that it found. wrong: force by which each is on
            the wrong bound, zero where it is right, shape (N, b). fewest: wrong ones in any pass before, shape (1,).
    """
    count, largest = np.reshape(np.sum(np.where(wrong > 0.0, 1.0, 0.0)), (1,)), np.max(wrong)
    from_on = np.where(count < fewest, 0.0 * count, largest)
    return np.where(wrong >= from_on, wanted, active), np.minimum(fewest, count)


@lru_cache(maxsize=KEPT)
def _forwards(problem: WindowProblem) -> Callable[[Arrays, Arrays, Arrays], tuple[Arrays, Arrays]]:
    """The Kalman filter over one row: prediction, measurements, active bounds."""
    n, q, states = problem.order, problem.layout.measurements, len(problem.bounded)

    def body(carry: Arrays, rows: Arrays, known: Arrays) -> tuple[Arrays, Arrays]:
        (before, mean, flat, free), (row_flat, point, active, fresh), (shared,) = carry, rows, known
        row = problem.layout.unpacked(row_flat)
        P = np.reshape(flat, (n, n))
        moved = problem.moved(before, row, shared)
        goes = row.moves > 0.5
        F = np.where(goes, moved.F, np.eye(n))
        bounded = (problem.disturbed, problem.noise_limits(row, shared))
        push, noise, noise_gains, noise_pulls = _held(np.zeros(n), moved.noise, *bounded, active[states:], np.zeros(n))
        mean = np.where(goes, moved.state + moved.F @ (mean - before) + push, mean)
        P = np.where(goes, predicted_covariance(P, moved.F, noise), P)
        spread = vector(*(P[i, i] for i in range(n)))
        own: Array = np.where(spread > _COLLAPSED * free, spread, free)
        pushed = (np.where(goes, push, 0.0 * push), np.where(goes, noise, 0.0 * noise))
        seen = problem.seen(point, row, shared)
        scale = vector(*_scales(problem, row, seen, P, fresh[0], shared))
        error = scale * (row.measured - seen.measured - seen.H @ (mean - point))
        H = np.reshape(scale, (q, 1)) * seen.H
        noise = seen.noise * np.outer(row.used, row.used) + np.diag(1.0 - row.used)
        after = correct(mean, P, error, H, noise, None, problem.form)
        forces = np.reshape(np.linalg.solve(after.innovation_covariance, np.reshape(error, (q, 1))), (q,))
        limits = (problem.bounded, problem.limits(shared))
        mean, P, gains, pulls = _held(after.estimate, after.covariance, *limits, active, _SOFT * own)
        handed = (point, mean, np.reshape(P, (n * n,)), own)
        kept = (*(np.reshape(m, (m.shape[0] * m.shape[1],)) for m in (F, H, after.gain, noise)), forces, gains, pulls)
        off = row.measured - seen.measured
        beyond = [np.where(off[j] * off[j] > FAR * FAR * seen.noise[j, j], row.used[j], 0.0) for j in range(q)]
        disturbed = (pushed[0], np.reshape(pushed[1], (n * n,)), noise_gains, noise_pulls)
        return handed, (mean, handed[2], own, *kept, vector(*beyond), *disturbed)

    return body


@lru_cache(maxsize=KEPT)
def _backwards(problem: WindowProblem) -> Callable[[Arrays, Arrays, Arrays], tuple[Arrays, Arrays]]:
    """The adjoint over one row: its state, its bounds, and what it says of the rows before."""
    n, q = problem.order, problem.layout.measurements

    def body(carry: Arrays, rows: Arrays, known: Arrays) -> tuple[Arrays, Arrays]:
        (adjoint, sums), (shared,) = carry, known
        row_flat, point, active, _, mean, flat, _, F, H, K, noise, forces, gains, pulls, beyond, *disturbed = rows
        row = problem.layout.unpacked(row_flat)
        P = np.reshape(flat, (n, n))
        x = mean - P @ adjoint
        adjoint, *found = _let_go(x, P, adjoint, gains, pulls, problem.bounded, problem.limits(shared), active)
        force = forces + np.reshape(K, (n, q)).T @ adjoint
        adjoint = adjoint - np.reshape(H, (q, n)).T @ force
        push, added, noise_gains, noise_pulls = disturbed
        Q = np.reshape(added, (n, n))
        w, limits, on_noise = push - Q @ adjoint, problem.noise_limits(row, shared), active[len(problem.bounded) :]
        _, *more = _let_go(w, Q, adjoint, noise_gains, noise_pulls, problem.disturbed, limits, on_noise)
        wanted, wrong = (vector(*(own + others or [0.0 * x[0]])) for own, others in zip(found, more, strict=True))
        adjoint = np.reshape(F, (n, n)).T @ adjoint
        x = problem.clipped(x, shared)
        square = force @ np.reshape(noise, (q, q)) @ force
        spread = vector(*(P[i, i] for i in range(n)))
        off = np.where(spread > 0.0, np.abs(x - point) / np.sqrt(np.where(spread > 0.0, spread, 1.0)), 0.0)
        exists = np.max(np.hstack([row.used, np.reshape(row.moves, (1,))]))
        most = np.maximum(sums[1], exists * np.max(off))
        sums = vector(sums[0] + square, most, sums[2] + np.sum(row.used), sums[3] + np.sum(beyond))
        return (adjoint, sums), (x, w, wanted, wrong)

    return body


@lru_cache(maxsize=KEPT)
def _followed(problem: WindowProblem) -> Callable[[Arrays, Arrays, Arrays], tuple[Arrays, Arrays]]:
    """A row as near to its estimate as the bounds of disturbances and states allow (where both cannot be, a state's),
    and what it lacks to be a course of the model."""

    def body(carry: Arrays, rows: Arrays, known: Arrays) -> tuple[Arrays, Arrays]:
        (about, before, lacks), (row_flat, point, push, own), (shared,) = carry, rows, known
        row, n = problem.layout.unpacked(row_flat), problem.order
        goes, into = row.moves > 0.5, problem.moved(about, row, shared)
        moved = into.state + into.F @ (before - about)
        lower, upper = problem.noise_limits(row, shared)
        values = [point[i] for i in range(n)]
        for k, i in enumerate(problem.disturbed):
            within = np.minimum(np.maximum(values[i], moved[i] + lower[k]), moved[i] + upper[k])
            values[i] = np.where(goes, within, values[i])
        x = problem.clipped(vector(*values), shared)
        off = np.abs(x - np.where(goes, moved + push, before))
        rounding = _SOFT * (1.0 + np.abs(x))  # a state that is known has no deviation, but is off where bounds push it
        off = np.where(off > rounding, off / np.sqrt(np.maximum(own, rounding * rounding)), 0.0)
        far = [np.where(push[i] * push[i] > FAR * FAR * into.noise[i, i], 1.0, 0.0) for i in range(n)]
        disturbed = np.where(goes, np.max(vector(*far)), 0.0)
        return (x, x, vector(np.maximum(lacks[0], np.max(off)), lacks[1] + disturbed)), (x,)

    return body


def _scales(problem: WindowProblem, row: WindowRow, seen: Seen, P: Array, fresh: Array, shared: Array) -> list[Array]:
    """Roots of the weights of the measurements; zero for one that is not used."""
    scales: list[Array] = []
    for j, loss in enumerate(problem.losses):
        if loss == "squares":
            scales.append(row.used[j])
            continue
        own = seen.noise[j, j]
        variance = own + np.where(fresh > 0.5, seen.H[j] @ P @ seen.H[j], 0.0)  # nothing has smoothed it yet
        residual = row.measured[j] - seen.measured[j]
        share = weight(loss, residual * residual / variance, problem.loss_scale(shared))
        scales.append(row.used[j] * np.sqrt(share))
    return scales


def _held(
    mean: Array, P: Array, places: tuple[int, ...], limits: Limits, active: Array, soft: Array
) -> tuple[Array, Array, Array, Array]:
    """Mean and covariance with the active bounds as measurements, of variance `soft` [shape (n,)], their gains and
    forces."""
    n = mean.shape[0]
    if not places:
        return mean, P, np.zeros(1), np.zeros(1)
    gains: list[Array] = []
    pulls: list[Array] = []
    for k, i in enumerate(places):
        free = np.where(np.abs(active[k]) > 0.5, P[i, i] + soft[i], 0.0)
        holds = free > 0.0
        inverse = np.where(holds, 1.0 / np.where(holds, free, 1.0), 0.0)
        gain = P[:, i] * inverse
        error = np.where(active[k] > 0.0, limits.upper[k], limits.lower[k]) - mean[i]
        mean = mean + gain * error
        P = symmetric(P - np.outer(gain, P[i]))
        gains.extend(gain[j] for j in range(n))
        pulls.append(error * inverse)
    return mean, P, vector(*gains), vector(*pulls)


def _let_go(
    x: Array,
    P: Array,
    adjoint: Array,
    gains: Array,
    pulls: Array,
    places: tuple[int, ...],
    limits: Limits,
    active: Array,
) -> tuple[Array, list[Array], list[Array]]:
    """The adjoint before the bounds of `_held`; which of them are wanted active, 1, -1 or 0; and the force by which
    each is wrong, zero where it stays."""
    n, (lower, upper) = x.shape[0], limits
    wanted, behind = [0.0 * x[0]] * len(places), [adjoint[i] for i in range(n)]
    wrong = list(wanted)
    for k, i in reversed(list(enumerate(places))):
        gain, held = gains[k * n : (k + 1) * n], np.abs(active[k]) > 0.5
        force = pulls[k] + gain @ vector(*behind)
        behind[i] = behind[i] - np.where(held, force, 0.0)
        above, below = x[i] > upper[k], x[i] < lower[k]
        crossed = np.where(above, 1.0, np.where(below, -1.0, 0.0))
        holds = force * active[k] < 0.0  # it pushes back, into the bounds
        wanted[k] = np.where(held, np.where(holds, active[k], 0.0), crossed)
        beyond = np.maximum(np.maximum(x[i] - upper[k], lower[k] - x[i]), 0.0)
        needed = beyond / np.where(P[i, i] > 0.0, P[i, i], 1.0)  # about the force that would bring it back
        wrong[k] = np.where(held, np.where(holds, 0.0, np.abs(force)), needed)
    return vector(*behind), wanted, wrong


def _at_bounds(problem: WindowProblem, before: Array, rows: Array, points: Array, shared: Array) -> Array:
    """1 where a state or a disturbance stands at its upper bound, -1 at its lower one, else 0, shape (N, b), at least
    (N, 1)."""
    if not problem.bounds:
        return np.zeros((points.shape[0], 1))
    lower, upper = problem.limits(shared)
    columns = []
    for k, i in enumerate(problem.bounded):
        x = points[:, i : i + 1]
        columns.append(np.where(x >= upper[k], 1.0, 0.0) - np.where(x <= lower[k], 1.0, 0.0))
    if problem.disturbed:
        _, (held,) = scan_table(_at_bound(problem), (before,), (rows, points), (shared,))
        columns.append(held)
    return np.hstack(columns)


@lru_cache(maxsize=KEPT)
def _at_bound(problem: WindowProblem) -> Callable[[Arrays, Arrays, Arrays], tuple[Arrays, Arrays]]:
    """Which disturbances stand at a bound on the way to a row."""

    def body(carry: Arrays, rows: Arrays, known: Arrays) -> tuple[Arrays, Arrays]:
        (before,), (row_flat, point), (shared,) = carry, rows, known
        row = problem.layout.unpacked(row_flat)
        moved, (lower, upper) = problem.moved(before, row, shared), problem.noise_limits(row, shared)
        at = []
        for k, i in enumerate(problem.disturbed):
            w, near = point[i] - moved.state[i], _NEAR * np.sqrt(moved.noise[i, i])
            bound = np.where(w >= upper[k] - near, 1.0, 0.0) - np.where(w <= lower[k] + near, 1.0, 0.0)
            at.append(np.where(row.moves > 0.5, bound, 0.0))
        return (point,), (vector(*at),)

    return body
