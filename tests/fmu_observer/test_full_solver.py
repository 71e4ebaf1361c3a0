"""Windows solved to convergence, against the Kalman filter, SciPy and the real-time iteration on the same equations."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize
from hypothesis import given, settings
from hypothesis import strategies as st

from fmu_observer.formulas.moving_horizon import gauss_newton
from fmu_observer.formulas.moving_horizon.arrival_cost import ArrivalCost, arrival_cost_at
from fmu_observer.formulas.moving_horizon.full_solution import Effort, WindowError
from fmu_observer.formulas.moving_horizon.full_solver import FullSolver
from fmu_observer.formulas.moving_horizon.row_window import RowLayout
from fmu_observer.formulas.moving_horizon.window_problem import Limits, Moved, Seen, WindowProblem
from fmu_observer.formulas.moving_horizon.window_program import WindowProgram, _SweptProgram
from plant_models.hybrid import vector

LAYOUT = RowLayout(inputs=1, measurements=2)
NOISE, READ = np.diag([0.0, 0.2]), np.diag([0.3**2, 0.1**2])  # the place gets no noise: Q is singular
SEES = np.array([[1.0, 0.0], [0.0, 1.0]])
START, SPREAD = np.array([1.0, 0.0]), np.diag([4.0, 1.0])
PRECISE = Effort(1e-9)
SOLVED = 1e-7  # PIQP ends at 1e-9 in the units of the problem; sums over 30 rows


def _moved(x, row, _shared):
    T = row.period
    F = np.vstack([np.hstack([1.0 + 0.0 * T, T]), np.hstack([0.0 * T, 1.0 + 0.0 * T])])
    return Moved(F @ x + row.inputs[0] * vector(0.5 * T * T, T), F, NOISE * T)


def _swinging(x, row, _shared):
    T = row.period
    moved = vector(x[0] + T * x[1], x[1] - T * 9.81 * np.sin(x[0]) + T * row.inputs[0])
    zero = 0.0 * T
    F = np.vstack([np.hstack([1.0 + zero, T]), np.hstack([-T * 9.81 * np.cos(x[0]), 1.0 + zero])])
    return Moved(moved, F, NOISE * T)


def _seen(x, _row, _shared):
    return Seen(SEES @ x, SEES + 0.0 * x[0], READ + 0.0 * x[0])


def _problem(moved=_moved, bounded=(), limits=((), ()), losses=("squares", "squares")):
    bounds = Limits(np.array(limits[0]), np.array(limits[1]))
    return WindowProblem(2, LAYOUT, moved, _seen, bounded, lambda _shared: bounds, losses, lambda shared: shared[0])


def _rows(count, seed, step=0.4):
    """Irregular rows, both, one or none of the measurements in them."""
    rng = np.random.default_rng(seed)
    periods = rng.uniform(0.01, step, count)
    used = rng.integers(0, 2, (count, 2)).astype(float)
    measured = rng.normal(0.0, 1.0, (count, 2)) * used
    return np.column_stack([np.ones(count), periods, np.cumsum(periods), rng.normal(size=count), measured, used])


def _solve(problem, rows, start=None, effort=PRECISE, arrival=None):
    points = np.tile(START, (len(rows), 1)) if start is None else start
    return FullSolver(problem).solve(arrival or arrival_cost_at(START, SPREAD), rows, points, np.array([1.5]), effort)


def _filtered(rows):
    """The Kalman filter in its textbook form."""
    x, P = START, SPREAD
    for row in rows:
        reported = LAYOUT.unpacked(row)
        moved = _moved(x, reported, None)
        x, P = moved.state, moved.F @ P @ moved.F.T + moved.noise
        for j in np.flatnonzero(reported.used):
            gain = P @ SEES[j] / (SEES[j] @ P @ SEES[j] + READ[j, j])
            x, P = x + gain * (reported.measured[j] - SEES[j] @ x), P - np.outer(gain, SEES[j] @ P)
    return x, P


def _stacked(rows):
    """Residuals of the linear window as ``A z - b`` of all start and noise values z, and states as ``S z + s``."""
    count = len(rows)
    S, s = np.zeros((count, 2, 2 + count)), np.zeros((count, 2))
    now, at = np.hstack([np.linalg.cholesky(SPREAD), np.zeros((2, count))]), START
    residuals, right = [np.eye(2 + count)], [np.zeros(2 + count)]
    for k, row in enumerate(rows):
        reported = LAYOUT.unpacked(row)
        moved = _moved(at, reported, None)
        now, at = moved.F @ now, moved.state
        now[:, 2 + k] = np.sqrt(moved.noise.diagonal())
        S[k], s[k] = now, at
        for j in np.flatnonzero(reported.used):
            residuals.append((now[j] / np.sqrt(READ[j, j]))[None])
            right.append(np.array([(reported.measured[j] - at[j]) / np.sqrt(READ[j, j])]))
    return np.vstack(residuals), np.hstack(right), S, s


@pytest.mark.parametrize("count", [1, 2, 30])
def test_a_linear_window_is_the_kalman_filter(count):
    rows = _rows(count, seed=count)
    found = _solve(_problem(), rows)
    estimate, covariance = _filtered(rows)
    assert found.converged
    assert found.estimate == pytest.approx(estimate, abs=SOLVED)
    assert found.covariance == pytest.approx(covariance, abs=1e-12)


def test_an_arrival_cost_that_has_moved_on_is_the_rows_that_have_left():
    rows, problem = _rows(20, seed=3), _problem()
    whole, arrival = _solve(problem, rows), arrival_cost_at(START, SPREAD)
    for row in rows[:13]:
        arrival = ArrivalCost(*map(np.asarray, gauss_newton.passed(problem, arrival, row, START, np.array([1.5]))))
    assert _solve(problem, rows[13:], arrival=arrival).estimate == pytest.approx(whole.estimate, abs=SOLVED)


def test_bounds_against_scipy():
    rows = _rows(12, seed=5)
    free = _solve(_problem(), rows)
    found = _solve(_problem(bounded=(1,), limits=([-0.3], [0.2])), rows)
    A, b, S, s = _stacked(rows)
    rates, offsets = S[:, 1], s[:, 1]
    wanted = scipy.optimize.minimize(
        lambda z: 0.5 * np.sum((A @ z - b) ** 2),
        np.zeros(A.shape[1]),
        jac=lambda z: A.T @ (A @ z - b),
        method="SLSQP",
        constraints={
            "type": "ineq",
            "fun": lambda z: np.hstack([rates @ z + offsets + 0.3, 0.2 - rates @ z - offsets]),
            "jac": lambda _z: np.vstack([rates, -rates]),
        },
        options={"ftol": 1e-12, "maxiter": 500},
    )
    assert np.ptp(free.states[:, 1]) > 0.6, "the bounds would be crossed"
    assert found.states[:, 1].min() >= -0.3
    assert found.states[:, 1].max() <= 0.2
    assert found.states == pytest.approx(S @ wanted.x + s, abs=2e-5)  # SLSQP's own tolerance
    assert found.cost <= wanted.fun + 1e-7


def test_the_huber_loss_against_scipy():
    rows = _rows(15, seed=6)
    rows[7, 4], rows[7, 6] = 40.0, 1.0  # a false balise
    found = _solve(_problem(losses=("huber", "huber")), rows)
    A, b, S, s = _stacked(rows)
    noises = A.shape[1]

    def huber(z):  # the noises count by their squares, the readings by the loss: scipy has one loss for all
        r = A @ z - b
        size = np.abs(r[noises:])
        return 0.5 * np.sum(r[:noises] ** 2) + np.sum(np.where(size > 1.5, 1.5 * size - 1.125, 0.5 * size**2))

    wanted = scipy.optimize.minimize(huber, np.zeros(noises), method="BFGS", options={"gtol": 1e-7})
    assert found.converged
    assert found.cost == pytest.approx(wanted.fun, rel=1e-9)
    assert found.states == pytest.approx(S @ wanted.x + s, abs=1e-5)  # BFGS by differences
    assert found.weights[7, 0] < 0.1


def test_a_false_balise_does_not_pull_where_squares_are_pulled_by_metres():
    rows = _rows(15, seed=6)
    rows[7, 6] = 0.0
    honest = _solve(_problem(), rows)
    rows[7, 4], rows[7, 6] = 60.0, 1.0
    pulled = _solve(_problem(), rows)
    robust = _solve(_problem(losses=("geman_mcclure", "squares")), rows, effort=Effort(1e-7))
    assert abs(pulled.states[7, 0] - honest.states[7, 0]) > 5.0
    assert abs(robust.states[7, 0] - honest.states[7, 0]) < 0.5
    assert robust.converged


def test_many_passes_of_the_real_time_iteration_come_to_an_equal_result():
    rows, problem = _rows(8, seed=8, step=0.1), _problem(_swinging, (1,), ([-0.5], [0.5]))
    found = _solve(problem, rows)
    points = np.tile(START, (len(rows), 1))
    passes = gauss_newton.solve(problem, arrival_cost_at(START, SPREAD), rows, points, np.array([1.5]), 30)
    assert found.converged
    assert found.active + (np.abs(found.states[:, 1]) >= 0.5 - 1e-9).sum() > 0, "a bound is active"
    assert np.array(passes.estimates) == pytest.approx(found.states, abs=SOLVED)


def test_what_cannot_be_is_refused_in_words():
    rows = _rows(4, seed=9)
    with pytest.raises(WindowError, match=r"state 1 contradict one another: at least 0\.5 and at most -0\.5"):
        _solve(_problem(bounded=(1,), limits=([0.5], [-0.5])), rows)
    broken = rows.copy()
    broken[2, 4] = np.nan
    with pytest.raises(WindowError, match="rows that is not finite"):
        _solve(_problem(), broken)
    rows[:, 3] = 0.0  # the place moves without noise of its own, from a known start: nothing brings it down
    known = ArrivalCost(np.array([5.0, 0.0]), np.array([5.0, 0.0]), np.zeros(4))
    low = _problem(bounded=(0, 1), limits=([0.0, 0.0], [2.0, 0.0]))
    with pytest.raises(WindowError, match="keeps all bounds; the first guess breaks them: state 0 is 5 in row 0"):
        _solve(low, rows, np.full((4, 2), [5.0, 0.0]), arrival=known)


def test_a_search_that_is_cut_short_keeps_the_last_feasible_point():
    rows, problem = _rows(20, seed=11, step=0.1), _problem(_swinging, (1,), ([-0.5], [0.5]))
    arrival = arrival_cost_at(np.array([1.5, 0.0]), SPREAD)
    whole = _solve(problem, rows, arrival=arrival)
    cut = _solve(problem, rows, effort=Effort(1e-9, max_iterations=1), arrival=arrival)
    late = _solve(problem, rows, whole.states, Effort(1e-9, deadline=0.0), arrival)
    assert (whole.converged, whole.feasible, whole.reason) == (True, True, "")
    assert whole.iterations > 2
    assert (cut.converged, cut.timed_out, cut.iterations) == (False, False, 1)
    assert cut.reason.startswith("not converged in 1 steps")
    assert np.abs(cut.states[:, 1]).max() <= 0.5
    assert (late.converged, late.timed_out, late.feasible, late.iterations) == (False, True, True, 0)
    assert late.reason == "deadline of 0 s after 0 steps"
    assert late.states == pytest.approx(whole.states, abs=1e-9)


@pytest.mark.foreign
def test_a_factor_graph_of_others_comes_to_an_equal_result():
    gtsam = pytest.importorskip("gtsam", reason="there are wheels for Linux on x86-64 only")
    rows, problem = _rows(25, seed=12), _problem(moved=_shaken)
    graph = gtsam.GaussianFactorGraph()
    graph.add(gtsam.JacobianFactor(0, np.eye(2), START, gtsam.noiseModel.Gaussian.Covariance(SPREAD)))
    for k, row in enumerate(rows):
        reported = LAYOUT.unpacked(row)
        moved = _shaken(START, reported, None)
        noise = gtsam.noiseModel.Gaussian.Covariance(moved.noise)
        graph.add(gtsam.JacobianFactor(k, -moved.F, k + 1, np.eye(2), moved.state - moved.F @ START, noise))
        for j in np.flatnonzero(reported.used):
            read = gtsam.noiseModel.Isotropic.Sigma(1, float(np.sqrt(READ[j, j])))
            graph.add(gtsam.JacobianFactor(k + 1, SEES[j : j + 1], reported.measured[j : j + 1], read))
    smoothed = graph.optimize()
    found = _solve(problem, rows)
    wanted = np.array([smoothed.at(k + 1) for k in range(len(rows))])
    assert found.states == pytest.approx(wanted, abs=SOLVED)


def _shaken(x, row, shared):
    moved = _moved(x, row, shared)
    return moved._replace(noise=moved.noise + 0.01 * row.period * np.eye(2))  # they know no noise of rank one


@given(seed=st.integers(0, 10_000), count=st.integers(1, 6), order=st.integers(1, 4))
@settings(max_examples=30)
def test_a_sweep_over_free_rows_is_the_programme_without_bounds(seed: int, count: int, order: int) -> None:
    """Rows without a measurement and states without noise among them; to the tolerance that PIQP is asked for, 1e-9 of
    numbers of size one, with a margin for the prices of states that nothing moves.
    """
    rng, shape = np.random.default_rng(seed), (count, order, order)
    roots, G = rng.normal(size=shape), np.tril(rng.normal(size=shape))
    roots[rng.random(count) < 0.3], G[rng.random((count, order)) < 0.2] = 0.0, 0.0
    A = np.einsum("kij,klj->kil", roots, roots)
    b = np.einsum("kij,kj->ki", roots, rng.normal(size=(count, order)))
    F = np.eye(order) + 0.3 * rng.normal(size=shape)
    F[0] = 0.0
    programme = A, b, F, G, 0.1 * rng.normal(size=(count, order))
    swept, solved = (program(count, order).solve_free(*programme) for program in (_SweptProgram, WindowProgram))
    assert swept.solved
    assert solved.solved
    for ours, theirs in zip(swept[:3], solved[:3], strict=True):
        np.testing.assert_allclose(np.abs(ours), np.abs(theirs), atol=1e-6 * (1.0 + np.abs(theirs).max()))
