"""Moving-horizon estimation against the Kalman filter, dense least squares, and readings that lie."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import casadi as ca
import clarabel
import numpy as np
import pytest
import scipy
import scipy.optimize
import scipy.sparse
from hypothesis import given, settings
from hypothesis import strategies as st
from own_condition import own_condition

from fmu_observer import OBSERVERS
from fmu_observer.formulas.moving_horizon import robust_loss
from fmu_observer.formulas.moving_horizon.arrival_cost import arrival_cost_at
from fmu_observer.formulas.moving_horizon.full_solution import Effort
from fmu_observer.formulas.moving_horizon.full_solver import FullSolver
from fmu_observer.formulas.moving_horizon.gauss_newton import passed, solve
from fmu_observer.formulas.moving_horizon.real_time_iteration import contradicted, iterate, unsettled
from fmu_observer.formulas.moving_horizon.row_window import RowLayout, WindowRow
from fmu_observer.formulas.moving_horizon.window_problem import Limits, Moved, Seen, WindowProblem
from fmu_observer.models.filter_models import Known, filter_model
from fmu_observer.models.known_models import find_model
from fmu_observer.observers.generic.discrete.moving_horizon_observer import MovingHorizonObserver, window_observability
from fmu_observer.observers.train.balise_moving_horizon import BaliseMovingHorizon
from plant_models.hybrid import Runtime, scalar_names, vector
from plant_models.hybrid.scan import enclosed, scan_table

N = 3  # position, speed, an unknown input
LAYOUT = RowLayout(inputs=1, measurements=2)
R = np.array([[0.3, 0.05], [0.05, 0.1]])
H = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.2]])
START, P0 = np.array([0.0, 1.0, 0.0]), np.diag([4.0, 2.0, 1.0])


def transition(T: Any) -> tuple[Any, Any]:
    """Of two integrators behind an unknown input, and its noise; one state has none of its own."""
    F = np.vstack(
        [
            np.hstack([1.0 + 0 * T, T, 0.5 * T * T]),
            np.hstack([0 * T, 1.0 + 0 * T, T]),
            np.hstack([0 * T, 0 * T, 1.0 + 0 * T]),
        ]
    )
    return F, np.diag(np.hstack([0.0 * T, 0.2 * T, 0.05 * T]))


JERK = 0.03  # bound of the disturbance of the unknown input, for each second


def problem(
    bounded: tuple[int, ...] = (), lower: float = -0.5, upper: float = 0.5, disturbed: tuple[int, ...] = ()
) -> WindowProblem:
    def moved(x: Any, row: WindowRow, _shared: Any) -> Moved:
        F, Q = transition(row.period)
        return Moved(F @ x + F[:, 1] * row.inputs[0], F, Q)

    def limits(_shared: Any) -> Limits:
        return Limits(np.full(len(bounded), lower), np.full(len(bounded), upper))

    noises = np.ones(len(disturbed))
    return WindowProblem(
        N,
        LAYOUT,
        moved,
        lambda x, _row, _shared: Seen(H @ x, H, R),
        bounded,
        limits,
        ("squares", "squares"),
        lambda s: s,
        disturbed=disturbed,
        noise_limits=lambda row, _shared: Limits(-JERK * noises * row.period, JERK * noises * row.period),
    )


@cache
def compiled(
    window: int, passes: int = 1, bounded: tuple[int, ...] = (), disturbed: tuple[int, ...] = ()
) -> Callable[..., Any]:
    """`iterate` as one traced function, as an observer's jump is."""
    sizes = (2 * N + N * N, window * LAYOUT.width, window * N, LAYOUT.width, N, 1)
    symbols = [ca.SX.sym(f"a{i}", size) for i, size in enumerate(sizes)]
    arrays = [ca.ArrayInterface.SX(s, shape=(s.numel(),)) for s in symbols]
    found = iterate(problem(bounded, disturbed=disturbed), passes, *arrays)
    values = (found.estimate, found.covariance, *found.remembered.values())
    return ca.Function("iterated", symbols, [ca.SX(value) for value in values])


def rows_of(seed: int, count: int) -> list[np.ndarray]:
    """Rows with gaps from a hundredth of a second to ten, of one measurement, both, or none."""
    rng = np.random.default_rng(seed)
    rows, t = [], 0.0
    for i in range(count):
        period = 0.0 if i == 0 else 10.0 ** rng.uniform(-2, 1)
        t += period
        used = rng.integers(0, 2, 2)
        rows.append(np.array([float(i > 0), period, t, rng.normal(), *(rng.normal(size=2) * used * 5), *used]))
    return rows


def kalman(rows: list[np.ndarray]) -> list[tuple[np.ndarray, np.ndarray]]:
    """The Kalman filter in its textbook form."""
    x, P, found = START, P0, []
    for row in rows:
        if row[0]:
            F, Q = transition(row[1])
            x, P = F @ x + F[:, 1] * row[3], F @ P @ F.T + Q
        used = row[6:] > 0.5
        if used.any():
            C, S = H[used], R[np.ix_(used, used)]
            K = P @ C.T @ np.linalg.inv(C @ P @ C.T + S)
            x, P = x + K @ (row[4:6][used] - C @ x), (np.eye(N) - K @ C) @ P
        found.append((x, P))
    return found


def moved_through(
    window: int,
    rows: list[np.ndarray],
    passes: int = 1,
    bounded: tuple[int, ...] = (),
    disturbed: tuple[int, ...] = (),
) -> list[Any]:
    function = compiled(window, passes, bounded, disturbed)
    arrival = np.concatenate(arrival_cost_at(START, P0))
    table, points, x, found = np.zeros(window * LAYOUT.width), np.tile(START, window), START, []
    for row in rows:
        point = x
        if row[0]:
            F, _ = transition(row[1])
            point = F @ x + F[:, 1] * row[3]
        after = (np.asarray(v).ravel() for v in function(arrival, table, points, row, point, 0.0))
        x, P, arrival, table, points, reported = after
        found.append((x, P.reshape(N, N), points.reshape(window, N), reported[-5:]))
    return found


def check_linear(window: int, seed: int) -> None:
    rows = rows_of(seed, 60)
    for (x, P, _, _), (expected, covariance) in zip(moved_through(window, rows), kalman(rows), strict=True):
        scale = np.sqrt(np.diag(covariance)).max() + np.abs(expected).max()
        assert np.abs(x - expected).max() <= 1e-9 * scale
        assert np.abs(P - covariance).max() <= 1e-9 * np.abs(covariance).max()


@settings(max_examples=4, deadline=None)
@given(window=st.integers(1, 50), seed=st.integers(0, 2**20))
def test_a_linear_window_is_the_kalman_filter(window: int, seed: int) -> None:
    check_linear(window, seed)


@pytest.mark.parametrize("window", range(1, 51))
def test_every_linear_window_is_the_kalman_filter(window: int) -> None:
    check_linear(window, window)


def test_estimates_of_the_window_are_the_smoothed_ones() -> None:
    """Against dense least squares over all rows; while no row has left, the window is the whole record."""
    rows = rows_of(3, 6)
    x = dense(rows, None)
    assert np.allclose(moved_through(6, rows)[-1][2], x, atol=1e-8 * np.abs(x).max())


def dense(rows: list[np.ndarray], bounds: tuple[int, float, float] | None) -> np.ndarray:
    """All states of a record as one bounded least-squares problem, shape (N, n); what has no noise gets very little."""
    count = len(rows)
    blocks, sides = [], []

    def add(at: dict[int, np.ndarray], side: np.ndarray, covariance: np.ndarray) -> None:
        root = np.linalg.inv(np.linalg.cholesky(covariance))
        block = np.zeros((len(side), count * N))
        for i, matrix in at.items():
            block[:, i * N : (i + 1) * N] = matrix
        blocks.append(root @ block)
        sides.append(root @ side)

    add({0: np.eye(N)}, START, P0)
    for i, row in enumerate(rows):
        if row[0]:
            F, Q = transition(row[1])
            add({i: np.eye(N), i - 1: -F}, F[:, 1] * row[3], Q + 1e-12 * np.eye(N))
        used = row[6:] > 0.5
        if used.any():
            add({i: H[used]}, row[4:6][used], R[np.ix_(used, used)])
    lower, upper = np.full(count * N, -np.inf), np.full(count * N, np.inf)
    if bounds is not None:
        lower[bounds[0] :: N], upper[bounds[0] :: N] = bounds[1:]
    A, b = np.vstack(blocks), np.concatenate(sides)
    found = scipy.optimize.lsq_linear(A, b, (lower, upper), method="bvls", tol=1e-14)
    return np.asarray(found.x).reshape(count, N)


def moved_dense(S: np.ndarray, s: np.ndarray, row: np.ndarray, k: int) -> tuple[np.ndarray, np.ndarray, float]:
    """A state ``S z + s`` of start and noises z one row further, and the size of the noise of its third state."""
    F, Q = transition(row[1])
    S, s = F @ S, F @ s + F[:, 1] * row[3]
    for place, i in enumerate((1, 2)):
        S[i, N + 2 * k + place] += np.sqrt(Q[i, i])
    return S, s, float(np.sqrt(Q[2, 2]))


def measured_dense(S: np.ndarray, s: np.ndarray, row: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """What a row measures of a state ``S z + s``, weighted: matrix and right side, or none where it measures
    nothing."""
    used = row[6:] > 0.5
    if not used.any():
        return [], []
    root = np.linalg.inv(np.linalg.cholesky(R[np.ix_(used, used)]))
    return [root @ H[used] @ S], [root @ (row[4:6][used] - H[used] @ s)]


def disturbed_dense(rows: list[np.ndarray]) -> np.ndarray:
    """All states of a record whose unknown input has bounded disturbances, shape (N, n): SciPy's active set over the
    start and the noises, which alone are unknown."""
    S, s = np.linalg.cholesky(P0), START
    S = np.hstack([S, np.zeros((N, 2 * len(rows)))])
    blocks, sides, states = [np.eye(S.shape[1])], [np.zeros(S.shape[1])], []
    bound = np.full(S.shape[1], np.inf)
    for k, row in enumerate(rows):
        if row[0]:
            S, s, noise = moved_dense(S, s, row, k)
            bound[N + 2 * k + 1] = JERK * row[1] / noise
        states.append((S.copy(), s))
        matrix, right = measured_dense(S, s, row)
        blocks += matrix
        sides += right
    A, b = np.vstack(blocks), np.concatenate(sides)
    z = scipy.optimize.lsq_linear(A, b, (-bound, bound), method="bvls", tol=1e-14).x
    assert (np.abs(z) >= bound * (1.0 - 1e-9)).any()  # a bound is active
    return np.array([S @ z + s for S, s in states])


@pytest.mark.parametrize("seed", range(3))
def test_bounds_give_the_bounded_optimum(seed: int) -> None:
    """Enough passes find the optimum of all states under bounds, that of another solver; the first seeds have 3 to 9
    states at a bound."""
    rows = [row for row in rows_of(seed, 12) if row[1] < 3.0]
    table = np.array(rows)
    points = np.tile(START, (len(rows), 1))
    found = solve(problem((2,)), arrival_cost_at(START, P0), table, points, np.zeros(1), 12)
    expected = dense(rows, (2, -0.5, 0.5))
    assert (np.abs(expected[:, 2]) > 0.5 - 1e-9).any()  # a bound is active
    assert np.allclose(found.estimates, expected, atol=2e-5 * np.abs(expected).max())  # the 1e-12 above
    assert found.moved[0] < 12.0  # it has settled


@pytest.mark.parametrize("seed", range(3))
def test_bounds_of_disturbances_give_the_bounded_optimum(seed: int) -> None:
    """Passes and the search to convergence against SciPy on the same equations."""
    rows = [row for row in rows_of(seed, 12) if row[1] < 3.0]
    table, points, evaluated = np.array(rows), np.tile(START, (len(rows), 1)), problem(disturbed=(2,))
    found = solve(evaluated, arrival_cost_at(START, P0), table, points, np.zeros(1), 12)
    expected = disturbed_dense(rows)
    scale = np.abs(expected).max()
    assert np.abs(found.estimates - expected).max() <= 1e-9 * scale
    full = FullSolver(evaluated).solve(arrival_cost_at(START, P0), table, points, np.zeros(1), Effort(1e-9))
    assert full.converged
    assert np.abs(full.states - expected).max() <= 1e-6 * scale  # PIQP ends at 1e-9 in the units of the problem


def grown(seed: int, size: float) -> Any:
    """Rows whose readings are `size` times as large."""
    rows = rows_of(seed, 30)
    for row in rows:
        row[4:6] *= size
    return rows


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**20), size=st.floats(0.1, 1e6))
def test_bounds_of_disturbances_are_never_broken(seed: int, size: float) -> None:
    rows = grown(seed, size)
    found = moved_through(8, rows, 2, (1,), (2,))
    for k, (_, _, points, _) in enumerate(found):
        assert np.abs(points[:, 1]).max() <= 0.5
        for i in range(1, min(8, k + 1)):
            T, F = rows[k - i + 1][1], transition(rows[k - i + 1][1])[0]
            push = points[-i][2] - F[2] @ points[-i - 1]
            assert abs(push) <= JERK * T + 1e-12 * np.abs(points).max()  # rounding of the difference


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**20), size=st.floats(0.1, 1e6))
def test_bounds_are_never_broken(seed: int, size: float) -> None:
    for _, _, points, _ in moved_through(8, grown(seed, size), 2, (1, 2)):
        assert np.abs(points[:, 1:]).max() <= 0.5


# -- observers ---------------------------------------------------------------------------------------------------------


def test_an_exact_model_without_noise_is_followed() -> None:
    observer = MovingHorizonObserver("pendulum", window=5)
    model = filter_model(find_model("pendulum"))
    runtime, x = Runtime(observer), model.start.copy()
    names = [s.name for s in observer.input_signals]
    for k in range(60):
        u = np.array([np.sin(0.1 * k)] * len(model.inputs))
        known = Known(0.0, u, np.zeros(0))
        if k:
            x = model.moved(x, model.no_noise(), known, model.sample_period)
        for name, value in zip([s.name for s in model.inputs], u, strict=True):
            runtime.u[names.index(name)] = value
        for s, y in zip(model.measurements, model.measured(x, model.no_reading_noise(), known), strict=True):
            runtime.u[names.index(f"measured_{s.name}")] = y
        if k:
            runtime.advance(k * model.sample_period)
        else:
            runtime.start(0.0)
        assert np.abs(runtime.update_outputs()[: model.order] - x).max() <= 1e-8


def run_train(
    observer: Any,
    wrong: float,
    seconds: float = 24.0,
    at: float = 16.0,
    seed: int = 1,
    twice: bool = False,
    restarts: list[float] | None = None,
) -> np.ndarray:
    """Position errors of a train with true effort, a balise every 8 s, the one at a time told wrong [m]."""
    runtime, rng = Runtime(observer), np.random.default_rng(seed)
    names, parameters = [s.name for s in observer.input_signals], [s.name for s in observer.parameter_signals]
    runtime.p[parameters.index("gate")] = 0.0
    runtime.p[parameters.index("odometer_gate")] = 1e6
    v, position, errors = 15.0, 0.0, []
    runtime.u[names.index("effort")] = 20e3
    runtime.u[names.index("odometer")] = v
    runtime.x[:2] = 3.0, 14.0
    runtime.start(0.0)
    for k in range(1, round(seconds / 0.1) + 1):
        a = (20e3 - 900.0 - 32.4 * v - 1.65287 * v * v) / 90e3
        position, v = position + 0.1 * v + 0.005 * a, v + 0.1 * a
        runtime.u[names.index("odometer")] = v + 0.1 * rng.normal()
        runtime.advance(0.1 * k)
        if k % 80 == 0:
            runtime.u[names.index("balise_position")] = (
                position + 0.5 * rng.normal() + (wrong if k == round(10 * at) else 0.0)
            )
            for _ in range(1 + twice):
                runtime.trigger("balise")
        errors.append(runtime.update_outputs()[0] - position)
    if restarts is not None:
        restarts.append(runtime.update_outputs()[[s.name for s in observer.outputs].index("restarts")])
    return np.array(errors)


def test_a_false_balise_pulls_least_squares_by_metres_and_the_robust_loss_not() -> None:
    pulled = np.abs(run_train(BaliseMovingHorizon(10, loss="squares"), 20.0)[160:230]).max()
    robust = np.abs(run_train(BaliseMovingHorizon(10), 20.0)[160:230]).max()
    assert pulled > 8.0  # the loss of squares believes it by three quarters and more
    assert robust < 1.5  # what it is without the false balise


@pytest.mark.parametrize("twice", [False, True])
@pytest.mark.parametrize("wrong", [40.0, -40.0])
def test_a_false_balise_that_comes_first_is_dropped_once_two_contradict_it(wrong: float, twice: bool) -> None:
    """From 24 s on, the third balise; one that is told twice is one, and does not vouch for itself."""
    restarts: list[float] = []
    errors = run_train(BaliseMovingHorizon(3), wrong, 26.0, at=8.0, twice=twice, restarts=restarts)
    assert np.abs(errors[90:230]).max() > 20.0
    assert np.abs(errors[241:]).max() < 3.0
    assert restarts[-1] == 1.0


@pytest.mark.parametrize("at", [16.0, 24.0, 1e3])
def test_a_window_that_refuses_one_balise_or_none_does_not_begin_anew(at: float) -> None:
    restarts: list[float] = []
    run_train(BaliseMovingHorizon(3), 40.0, 34.0, at=at, seed=round(at), restarts=restarts)
    assert restarts[-1] == 0.0


@pytest.mark.parametrize(("speed", "locked", "recover"), [(15.0, 3.0, 4.0), (6.0, 2.0, 5.0)])
def test_a_wheel_that_is_locked_from_the_start_is_left_once_it_turns_again(
    speed: float, locked: float, recover: float
) -> None:
    """The window believes that the train stands, and doubts the right readings for `odometer_recover`, no longer."""
    runtime = Runtime(BaliseMovingHorizon(3))
    names, parameters = (
        [s.name for s in kind] for kind in (runtime.system.input_signals, runtime.system.parameter_signals)
    )
    runtime.p[parameters.index("odometer_recover")] = recover
    runtime.u[names.index("effort")] = 900.0 + 32.4 * speed + 1.65287 * speed**2  # as fast all the time
    runtime.x[:2] = 0.0, speed
    runtime.start(0.0)
    found = []
    for k in range(1, round((locked + recover + 3.0) / 0.1) + 1):
        runtime.u[names.index("odometer")] = speed if 0.1 * k > locked else 0.0
        runtime.advance(0.1 * k)
        found.append(runtime.update_outputs()[[s.name for s in runtime.system.outputs].index("speed")])
    assert abs(found[round(10 * (locked + recover)) - 5]) < 0.2 * speed
    assert abs(found[-1] - speed) < 0.3


def test_with_squares_and_no_active_bound_it_is_the_filter() -> None:
    filtered = run_train(OBSERVERS["balise_odometer_ekf"](), 0.0, 9.0)
    assert np.abs(run_train(BaliseMovingHorizon(5, loss="squares"), 0.0, 9.0) - filtered).max() <= 1e-9


def test_contradictory_bounds_are_refused_in_words() -> None:
    runtime = Runtime(MovingHorizonObserver("linear_pendulum", bounds={"rate": [-1.0, 1.0]}))
    runtime.p[scalar_names(runtime.system.parameter_signals).index("lower_bounds[1]")] = 2.0
    with pytest.raises(ValueError, match=r"lower_bounds\[1\] must be below upper_bounds\[1\], the bounds of rate"):
        runtime.start(0.0)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"bounds": {"y": [0, 1]}}, " bounds: no state 'y'; states: angle, rate"),
        ({"bounds": {"angle": [0, 1, 2]}}, "expected .lowest, highest."),
        ({"bounds": {"rate": [1.0, -1.0]}}, "bounds of 'rate' are .1.0, -1.0.; the lowest must be below the highest"),
        ({"bounds": {"rate": [0.0, float("nan")]}}, "bounds of 'rate' are .0.0, nan.; expected .lowest, highest."),
        ({"bounds": {"rate": 3.0}}, "bounds of 'rate' are 3.0; expected .lowest, highest."),
        ({"bounds": "rate"}, "bounds = 'rate'; expected .lowest, highest. by name of a state"),
        ({"noise_bounds": {"rate": [0.1, 1.0]}}, "noise_bounds of 'rate' are .0.1, 1.0.; zero must lie within"),
        ({"noise_bounds": {"y": [-0.1, 1.0]}}, " noise_bounds: no state 'y'; states: angle, rate"),
        ({"loss": "tukey"}, "expected one of squares, huber, geman_mcclure"),
        ({"window": 0}, "window must be 1 to 1000"),
        ({"passes": 0}, "passes must be 1 to 20"),
    ],
)
def test_illegal_options_are_refused_in_words(options: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        MovingHorizonObserver("linear_pendulum", **options)


def test_a_window_that_does_not_show_a_state_says_which() -> None:
    short, long = (own_condition(MovingHorizonObserver("linear_pendulum", window=w)) for w in (1, 2))
    assert short.numbers["window_rank"] == 1
    assert "A window of 1 full row shows 1 without the arrival cost; it does not show rate," in short.statement
    assert long.numbers["window_rank"] == 2
    assert "A window of 2 full rows shows all of them" in long.statement


def reaction(**options: Any) -> MovingHorizonObserver:
    return MovingHorizonObserver("gas_phase_reaction", outputs=["y"], unknown=["rate"], substeps=1, **options)


@pytest.mark.parametrize(("period", "condition", "spread"), [(0.01, 8.7e3, 0.16), (0.1, 197.0, 0.0035)])
def test_the_window_of_a_reaction_is_as_ill_conditioned_as_known(
    period: float, condition: float, spread: float
) -> None:
    """Condition and deviation of the rate at noise of 1e-3, computed independently from the closed form."""
    model = reaction().model
    known = Known(0.0, np.zeros(0), np.array([v for s in model.parameters for v in s.start_values]))
    measured = window_observability(model, known, period, 11).measured
    assert np.linalg.cond(measured) == pytest.approx(condition, rel=5e-3)
    assert 1e-3 * np.sqrt(np.linalg.inv(measured.T @ measured)[2, 2]) == pytest.approx(spread, rel=2e-2)


def test_an_unknown_rate_is_found_within_its_bounds() -> None:
    observer = reaction(window=11, passes=3, bounds={"rate": [0.1, 0.35]})
    runtime = Runtime(observer)
    parameters = scalar_names(observer.parameter_signals)
    for name, value in {"process_covariance": 0.0, "measurement_covariance": 1e-8, "sample_period": 0.1}.items():
        for i, scalar in enumerate(parameters):
            if scalar.split("[")[0] == name:
                runtime.p[i] = value
    runtime.x[:3] = 2.3, 0.7, 0.3  # the total pressure is measured, so it is right
    rates = []
    for k in range(60):
        a = 2.5 / (1.0 + 0.3 * 2.5 * 0.1 * k)
        runtime.u[0] = a + 0.5 * (3.5 - a)
        runtime.advance(0.1 * k) if k else runtime.start(0.0)
        rates.append(runtime.update_outputs()[2])
    assert abs(rates[-1] - 0.15) < 1e-3
    assert min(rates) >= 0.1
    assert max(rates) <= 0.35


@pytest.mark.parametrize("names", [["y"], ["rate", "rate"]])
def test_what_is_unknown_must_be_there(names: list[str]) -> None:
    with pytest.raises(ValueError, match=r"expected names of its inputs .none. or of its scalar parameters .rate"):
        MovingHorizonObserver("gas_phase_reaction", outputs=["y"], unknown=names)


# -- formulas ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("loss", robust_loss.LOSSES)
def test_weights_are_the_slopes_of_the_losses(loss: robust_loss.Loss) -> None:
    squared, h = np.array([0.01, 0.5, 4.0, 100.0]), 1e-5
    slope = (robust_loss.cost(loss, squared + h, 1.5) - robust_loss.cost(loss, squared - h, 1.5)) / (2 * h)
    assert np.allclose(2.0 * slope, robust_loss.weight(loss, squared, 1.5), atol=1e-9)


@pytest.mark.parametrize("count", [1, 16, 17, 50])
@pytest.mark.parametrize("backwards", [False, True])
def test_a_traced_loop_is_the_loop(count: int, backwards: bool) -> None:
    def body(carry: Any, row: Any, shared: Any) -> Any:
        c = 0.5 * carry[0] + row[0][0] * shared[0]
        return (c,), (np.hstack([c, row[0]]), vector(c[0]))

    def looped(start: Any, flat: Any, known: Any) -> Any:
        last, found = scan_table(body, (start,), (np.reshape(flat, (count, 3)),), (known,), backwards=backwards)
        return last[0], np.reshape(found[0], (count * 5,)), np.reshape(found[1], (count,))

    rng = np.random.default_rng(0)
    values = [rng.normal(size=k) for k in (2, 3 * count, 2)]
    symbols = [ca.SX.sym(f"a{i}", len(v)) for i, v in enumerate(values)]
    arrays = [ca.ArrayInterface.SX(s, shape=(s.numel(),)) for s in symbols]
    traced = ca.Function("f", symbols, [ca.SX(v) for v in enclosed(looped, *arrays)])
    for expected, found in zip(looped(*values), traced(*values), strict=True):
        assert np.abs(expected - np.asarray(found).ravel()).max() == 0.0


@pytest.mark.parametrize("loss", robust_loss.LOSSES)
def test_bounds_that_most_measurements_contradict_are_reported(loss: Any) -> None:
    """A speed of 1 is held at 0.5 while all say 10: what a robust loss lets go is counted all the same."""
    counted = {}
    for measured in (0.0, 10.0):
        row = WindowRow(1.0, 0.5, 0.0, np.zeros(1), np.full(2, measured), np.ones(2))
        rows, points = np.tile(LAYOUT.packed(row), (4, 1)), np.zeros((4, N))
        evaluated = replace(problem((1,)), losses=(loss,) * 2, loss_scale=lambda _shared: 3.0)
        found = solve(evaluated, arrival_cost_at(START, 1e-3 * P0), rows, points, np.zeros(1), 3)
        counted[measured] = contradicted(found.bounds, found.far, found.broken)[0]
    assert counted == {0.0: 0.0, 10.0: 1.0}


@pytest.mark.parametrize("loss", ["squares", "huber"])
def test_a_bound_against_which_disturbances_bend_the_course_is_reported(loss: Any) -> None:
    """The place, measured well, goes on at 10 m/s while the speed is held at 0.5: disturbances explain every reading,
    each far outside of its own deviation, and no residual is far. (`geman_mcclure` doubts the readings.)"""
    reported = {}
    for speed in (0.4, 10.0):
        rows = np.array([[1.0, 0.1, 0.1 * k, 0.0, speed * 0.1 * k, 0.0, 1.0, 0.0] for k in range(1, 9)])
        evaluated = replace(
            problem((1,)),
            losses=(loss,) * 2,
            loss_scale=lambda _shared: 3.0,
            moved=_shaken,
            seen=lambda x, _row, _shared: Seen(H @ x, H, 1e-6 * R),
        )
        start = arrival_cost_at(np.array([0.0, 0.4, 0.0]), 1e-6 * P0)
        found = solve(evaluated, start, rows, np.tile(START, (8, 1)), np.zeros(1), 8)
        reported[speed] = contradicted(found.bounds, found.far, found.broken)[0]
    assert reported == {0.4: 0.0, 10.0: 1.0}


def _shaken(x: Any, row: WindowRow, _shared: Any) -> Moved:
    F, Q = transition(row.period)
    return Moved(F @ x, F, Q + np.diag(np.hstack([1e-4, 0.0, 0.0])))


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**20), size=st.floats(1.0, 1e3))
def test_bounds_that_no_course_keeps_are_reported(seed: int, size: float) -> None:
    """A known start outside of its bound, and no noise that could bring it in; and the same start within."""
    rows = np.array([row for row in rows_of(seed, 8) if row[1] < 3.0])
    rows[:, 3:] = 0.0
    still = replace(problem((0,), -0.5, 0.5), moved=lambda x, row, _s: Moved(x, np.eye(N) + 0.0 * row.period, 0.0 * P0))
    reported = {}
    for start in (size, 0.25):
        known = np.array([start, 0.0, 0.0])
        found = solve(still, arrival_cost_at(known, 0.0 * P0), rows, np.tile(known, (len(rows), 1)), np.zeros(1), 4)
        reported[start] = contradicted(found.bounds, found.far, found.broken)[0]
    assert reported == {size: 1.0, 0.25: 0.0}


def inequalities(rows: np.ndarray, bounded: tuple[int, ...], disturbed: bool) -> tuple[str, np.ndarray]:
    """States at the optimum by the interior-point solver Clarabel over the start and the noises, and its status."""
    S, s = np.hstack([np.linalg.cholesky(P0), np.zeros((N, 2 * len(rows)))]), START
    A, b, states = [np.eye(S.shape[1])], [np.zeros(S.shape[1])], []
    G: list[np.ndarray] = []
    h: list[float] = []
    for k, row in enumerate(rows):
        if row[0]:
            S, s, noise = moved_dense(S, s, row, k)
            if disturbed:
                pushed = noise * np.eye(S.shape[1])[N + 2 * k + 1]
                G, h = [*G, pushed, -pushed], [*h, JERK * row[1], JERK * row[1]]
        states.append((S.copy(), s))
        for i in bounded:
            G, h = [*G, S[i], -S[i]], [*h, 0.5 - s[i], 0.5 + s[i]]
        matrix, side = measured_dense(S, s, row)
        A += matrix
        b += side
    left, right = np.vstack(A), np.concatenate(b)
    exact = clarabel.DefaultSettings()
    exact.verbose, exact.tol_gap_abs, exact.tol_gap_rel, exact.tol_feas = False, 1e-11, 1e-11, 1e-11
    cost, sides = (scipy.sparse.csc_matrix(m) for m in (np.triu(left.T @ left), np.array(G)))
    cones = [clarabel.NonnegativeConeT(len(h))]
    found = clarabel.DefaultSolver(cost, -left.T @ right, sides, np.array(h), cones, exact).solve()
    return str(found.status), np.array([S @ np.array(found.x) + s for S, s in states])


def check_settles(seed: int) -> None:
    """Bounds of two states and of a disturbance, which depend on each other: 4 to 30 rows, from a cold start.

    Clarabel ends at 1e-11 of the cost, which is flat to the root of that; hence 2e-5 of the largest state.
    """
    bounded, disturbed = ((1,), (2,), (1, 2))[seed % 3], seed % 4 == 0
    count = int(np.random.default_rng(seed).integers(4, 30))
    rows = np.array([row for row in rows_of(seed, count) if row[1] < 3.0])
    status, expected = inequalities(rows, bounded, disturbed)
    if status != "Solved":
        return
    evaluated, points = problem(bounded, disturbed=(2,) if disturbed else ()), np.tile(START, (len(rows), 1))
    found = solve(evaluated, arrival_cost_at(START, P0), rows, points, np.zeros(1), 60)
    assert found.moved[0] < 60.0
    assert found.broken[0] <= 1e-4
    assert np.abs(found.estimates - expected).max() <= 2e-5 * max(1.0, np.abs(expected).max())


@pytest.mark.parametrize("seed", [8, 20, 52, 64, 92, 124, 136, 160])
def test_an_active_set_that_would_come_back_for_ever_settles_at_the_optimum(seed: int) -> None:
    """Windows whose active set cycles where all wrong bounds change at once."""
    check_settles(seed)


@pytest.mark.parametrize("first", range(0, 500, 50))
def test_every_active_set_settles_at_the_optimum(first: int) -> None:
    for seed in range(first, first + 50):
        check_settles(4 * seed)


def rao(passes: int) -> tuple[float, np.ndarray]:
    """Errors (root of the mean square), and last step and error of the course of each row, of the example of Rao,
    Rawlings and Lee, Automatica 37 (2001) 1619: ``w = |z|`` is known not to be negative; a draw of 40 rows."""
    layout, Q, C, read = RowLayout(0, 1), np.diag([0.0, 1.0]), np.array([[1.0, -3.0]]), np.array([[0.01]])

    def ahead(x: np.ndarray) -> np.ndarray:
        return np.array([0.99 * x[0] + 0.2 * x[1], -0.1 * x[0] + 0.5 * x[1] / (1.0 + x[1] ** 2)])

    def moved(x: Any, _row: WindowRow, _shared: Any) -> Moved:
        slope = 0.5 * (1.0 - x[1] ** 2) / (1.0 + x[1] ** 2) ** 2
        return Moved(ahead(x), np.array([[0.99, 0.2], [-0.1, slope]]), Q)

    evaluated = replace(
        problem(disturbed=(1,)),
        order=2,
        layout=layout,
        moved=moved,
        seen=lambda x, _row, _shared: Seen(C @ x, C, read),
        losses=("squares",),
        noise_limits=lambda _row, _shared: Limits(np.zeros(1), np.full(1, 1e30)),
    )
    errors, reported = [], []
    rng, x, arrival = np.random.default_rng(1), np.zeros(2), arrival_cost_at(np.zeros(2), np.eye(2))
    points, table = np.zeros((10, 2)), np.zeros((10, layout.width))
    for k in range(40):
        x = ahead(x) + np.array([0.0, abs(rng.normal())]) if k else x
        arrival = passed(evaluated, arrival, table[0], points[0], np.zeros(1))
        table = np.vstack([table[1:], [float(k > 0), 1.0, k, (C @ x)[0] + 0.1 * rng.normal(), 1.0]])
        points = np.vstack([points[1:], ahead(points[-1]) if k else points[-1]])
        found = solve(evaluated, arrival, table, points, np.zeros(1), passes)
        points = np.asarray(found.estimates)
        errors.append(points[-1] - x)
        reported.append(unsettled(found.step, found.broken)[0])
    return float(np.sqrt(np.mean(np.square(errors)))), np.array(reported)


def test_passes_that_are_too_few_are_reported() -> None:
    """Two passes end half as far off again as convergence and more, and say so in most rows; ten in none."""
    (few, reported), (many, none) = rao(2), rao(10)
    assert few > 1.5 * many
    assert reported.mean() > 0.8
    assert not none.any()


def test_under_a_robust_loss_no_nis_is_reported() -> None:
    for make in (
        lambda loss: MovingHorizonObserver("linear_pendulum", loss=loss),
        lambda loss: BaliseMovingHorizon(loss=loss),
    ):
        assert "nis" in {s.name for s in make("squares").outputs}
        assert "nis" not in {s.name for s in make("geman_mcclure").outputs}
