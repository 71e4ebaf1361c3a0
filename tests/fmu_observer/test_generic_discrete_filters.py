"""Discrete Luenberger observers and Kalman filters, against references written out in NumPy."""

from dataclasses import replace

import control
import numpy as np
import pytest
from generic_runner import exact_states, sampled_run
from hypothesis import given, settings
from hypothesis import strategies as st
from own_condition import own_condition
from scipy.linalg import expm

from fmu_observer.certificates.printed_bounds.discrete_bounds import _circle_distance, _transition_lipschitz, centre_of
from fmu_observer.models.discrete_model import _zero_order_hold, transition
from fmu_observer.models.exhibits.pendulum_model import linear_pendulum, pendulum
from fmu_observer.models.known_models import find_model
from fmu_observer.models.scaled_slopes import powers, scaled
from fmu_observer.models.train.freight_train_model import freight_train
from fmu_observer.observability import UnobservableError
from fmu_observer.observers.generic.discrete import (
    DiscreteLuenberger,
    ExtendedKalmanFilter,
    ExtendedLuenberger,
    KalmanFilter,
)
from plant_models.hybrid import vector

T, COUNT = 0.1, 60
TORQUES = np.sin(0.37 * np.arange(COUNT))


def noisy_angles(states: np.ndarray, seed: int = 1) -> np.ndarray:
    return np.asarray(states[:, 0] + 0.01 * np.random.default_rng(seed).normal(size=len(states)))


# -- Luenberger -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("period", [0.1, 0.17])
def test_the_error_follows_the_powers_of_the_closed_matrix(period: float) -> None:
    """Also at another period than the one of the design: A_d follows the parameter."""
    observer, start = DiscreteLuenberger(), np.array([0.4, -0.3])
    states = exact_states(observer.model, start, TORQUES, period)
    errors = sampled_run(observer, TORQUES, states[:, 0], period)[:, :2] - states
    closed = expm(observer.model.A * period) - observer.start_parameters()[:2, None] @ observer.model.C
    expected = [np.linalg.matrix_power(closed, k) @ -start for k in range(COUNT + 1)]
    np.testing.assert_allclose(errors, expected, atol=1e-9)  # the reference solver works at 1e-12 a sample


def test_estimates_belong_to_the_sample_they_are_published_at() -> None:
    """Started right, the observer agrees with the plant at every sample, the first one included."""
    model = replace(
        linear_pendulum(),
        states=tuple(replace(s, start=v) for s, v in zip(linear_pendulum().states, (0.4, -0.3), strict=True)),
    )
    states = exact_states(model, np.array([0.4, -0.3]), TORQUES, T)
    for observer in (DiscreteLuenberger(model), KalmanFilter(model)):
        np.testing.assert_allclose(sampled_run(observer, TORQUES, states[:, 0], T)[:, :2], states, atol=1e-9)


def test_conditions_of_the_discrete_luenberger_observer() -> None:
    values = own_condition(DiscreteLuenberger()).numbers
    # a double pole: the root of a rounding
    assert values["spectral_radius"] == pytest.approx(np.exp(-2.0 * T), rel=1e-6)
    assert own_condition(DiscreteLuenberger()).holds
    assert not own_condition(DiscreteLuenberger(), {"gain": [0.0, -2.0]}).holds


def test_the_extended_luenberger_observer_converges_where_its_condition_holds() -> None:
    observer = ExtendedLuenberger()
    assert own_condition(observer).holds
    for start in ([2.5, 0.0], [-1.0, 3.0]):
        states = exact_states(observer.model, np.array(start), np.sin(0.37 * np.arange(120)), T)
        errors = sampled_run(observer, np.sin(0.37 * np.arange(120)), states[:, 0], T)[:, :2] - states
        assert np.linalg.norm(errors[-1]) < 1e-5 * np.linalg.norm(start)
    slow = own_condition(observer, {"gain": [0.05, 0.0]})
    assert slow.numbers["spectral_radius"] < 1.0
    assert not slow.holds


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.02, 0.5), st.floats(0.5, 20.0))
def test_the_lipschitz_bound_of_the_transition_is_never_exceeded(seed: int, period: float, scale: float) -> None:
    model, generator = pendulum(), np.random.default_rng(seed)
    one = generator.normal(0.0, 2.0, 2)
    other, u = one + generator.normal(0.0, 10.0 ** generator.uniform(-3.0, 0.5), 2), generator.normal(size=1)
    change = transition(model, one, u, period) - transition(model, other, u, period)
    nonlinear = (change - expm(centre_of(model) * period) @ (one - other)) / powers(scale, 2)
    bound = _transition_lipschitz(model, period, scale) * np.linalg.norm((one - other) / powers(scale, 2))
    assert np.linalg.norm(nonlinear) <= bound * (1.0 + 1e-3) + 1e-12  # the Runge-Kutta step is not the flow


def test_no_perturbation_below_the_distance_leaves_the_unit_circle() -> None:
    found, generator = own_condition(ExtendedLuenberger()).numbers, np.random.default_rng(4)
    gain = ExtendedLuenberger().start_parameters()[:2, None]
    closed = scaled(expm(centre_of(pendulum()) * T) - gain @ pendulum().C, found["scale"])
    for _ in range(300):
        perturbation = generator.normal(size=(2, 2))
        perturbation *= 0.999 * found["bound"] / np.linalg.norm(perturbation, 2)
        assert np.abs(np.linalg.eigvals(closed + perturbation)).max() < 1.0


def test_the_distance_to_the_circle_by_hand() -> None:
    assert _circle_distance(np.diag([0.5, -0.2])) == pytest.approx(0.5, abs=1e-3)
    assert _circle_distance(np.array([[0.0, 1.0], [-0.81, 0.0]])) < 0.19  # poles at +-0.9i


# -- Kalman -----------------------------------------------------------------------------------------------------------


def textbook_filter(
    observer: ExtendedKalmanFilter, torques: np.ndarray, measured: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Estimates and covariances after each sample: P = (I - K C) P, Jacobians by central differences."""
    model, p = find_model(observer.model.name), observer.start_parameters()
    QN, RN, x, P, C = p[:4].reshape(2, 2), p[4:5].reshape(1, 1), np.zeros(2), np.eye(2), model.C
    estimates, covariances = [], []
    for k, y in enumerate(measured):
        if k:
            u = torques[k - 1 : k]
            sides = [[transition(model, x + s * 1e-5 * e, u, T) for s in (1.0, -1.0)] for e in np.eye(2)]
            F = np.stack([(a - b) / 2e-5 for a, b in sides], axis=1)
            x, P = transition(model, x, u, T), F @ P @ F.T + QN
        K = P @ C.T @ np.linalg.inv(C @ P @ C.T + RN)
        x, P = x + K @ (y - C @ x), (np.eye(2) - K @ C) @ P
        estimates.append(x)
        covariances.append(P)
    return np.array(estimates), np.array(covariances)


@pytest.mark.parametrize("cls", [KalmanFilter, ExtendedKalmanFilter])
def test_estimates_and_covariances_are_those_of_the_textbook(cls: type[ExtendedKalmanFilter]) -> None:
    observer = cls()
    states = exact_states(find_model(observer.model.name), np.array([1.0, 0.5]), TORQUES, T)
    measured = noisy_angles(states)
    rows = sampled_run(observer, TORQUES, measured, T)
    estimates, covariances = textbook_filter(observer, TORQUES, measured)
    # Central differences of 1e-5 leave 1e-10 in the Jacobian, and the filter forgets them.
    np.testing.assert_allclose(rows[:, :2], estimates, atol=1e-8)
    np.testing.assert_allclose(rows[:, 2:6].reshape(-1, 2, 2), covariances, atol=1e-9)
    np.testing.assert_array_equal(rows[:, 3], rows[:, 4])  # symmetric to the last bit


def test_the_linear_filter_settles_at_the_riccati_solution() -> None:
    observer = KalmanFilter()
    p, model = observer.start_parameters(), linear_pendulum()
    Ad, _ = _zero_order_hold(model.A, model.B, T)
    QN, RN = p[:4].reshape(2, 2), p[4:5].reshape(1, 1)
    _, P, _ = control.dlqe(Ad, np.eye(2), model.C, QN, RN)
    updated = P - P @ model.C.T @ np.linalg.inv(model.C @ P @ model.C.T + RN) @ model.C @ P
    last = sampled_run(observer, np.zeros(300), np.zeros(301), T)[-1]
    np.testing.assert_allclose(last[2:6].reshape(2, 2), updated, rtol=1e-8)
    closed = Ad @ (np.eye(2) - P @ model.C.T @ np.linalg.inv(model.C @ P @ model.C.T + RN) @ model.C)
    assert own_condition(observer).numbers["spectral_radius"] == pytest.approx(
        np.abs(np.linalg.eigvals(closed)).max(), rel=1e-9
    )


def test_the_covariance_is_that_of_the_errors() -> None:
    """300 runs with noises as declared: the mean of e' inv(P) e is 2, its standard deviation 2 / sqrt(300)."""
    observer, generator = KalmanFilter(), np.random.default_rng(11)
    p = observer.start_parameters()
    Ad, _ = _zero_order_hold(linear_pendulum().A, linear_pendulum().B, T)
    root = np.linalg.cholesky(p[:4].reshape(2, 2))
    values = []
    for _ in range(300):
        x = generator.normal(size=2)  # P = I at the start
        states = [x := Ad @ x + root @ generator.normal(size=2) if k else x for k in range(25)]
        measured = np.array(states)[:, 0] + np.sqrt(p[4]) * generator.normal(size=25)
        last = sampled_run(observer, np.zeros(24), measured, T)[-1]
        error = last[:2] - states[-1]
        values.append(error @ np.linalg.solve(last[2:6].reshape(2, 2), error))
    assert np.mean(values) == pytest.approx(2.0, abs=3.5 * 2.0 / np.sqrt(300.0))


def test_standard_deviations_are_outputs() -> None:
    observer = ExtendedKalmanFilter()
    x = observer.start_state()
    x[:10] = [0.1, 0.2, 4.0, 1.0, 1.0, 9.0, 0.3, 16.0, 5.0, 6.0]
    p, u = observer.unpack_parameters(observer.start_parameters()), observer.unpack_inputs(np.zeros(2))
    assert observer.output(0.0, observer.unpack_states(x), u, p) == {
        "angle": 0.1,
        "rate": 0.2,
        "angle_std": 2.0,
        "rate_std": 3.0,
        "innovation_angle": 0.3,
        "innovation_covariance": [16.0],
        "nis": 5.0,
        "innovation_likelihood": 6.0,
        "covariance_not_positive": 0.0,
    }


def test_the_extended_filter_follows_where_the_linear_one_is_wrong() -> None:
    states = exact_states(pendulum(), np.array([2.5, 0.0]), 0.0 * TORQUES, T)
    measured = noisy_angles(states)
    extended = sampled_run(ExtendedKalmanFilter(), 0.0 * TORQUES, measured, T)[20:, :2] - states[20:]
    linear = sampled_run(KalmanFilter(), 0.0 * TORQUES, measured, T)[20:, :2] - states[20:]
    assert np.sqrt(np.mean(extended**2)) < 0.5 * np.sqrt(np.mean(linear**2))


def test_a_filter_without_a_steady_state_says_so() -> None:
    assert own_condition(KalmanFilter()).holds
    undriven = KalmanFilter(replace(linear_pendulum(), A=np.array([[0.0, 1.0], [0.0, 0.0]])))
    assert not own_condition(undriven, {"process_covariance": 0.0}).holds


@pytest.mark.parametrize("kind", [KalmanFilter, ExtendedKalmanFilter])
def test_a_mode_that_is_not_measured_is_refused_unless_it_decays(kind: type[ExtendedKalmanFilter]) -> None:
    with pytest.raises(
        UnobservableError, match=r"filter of linear_pendulum: .*eigenvalue 0.1 1/s \(grows .*rate \(1\)"
    ):
        kind(replace(linear_pendulum(), A=np.array([[0.1, 0.0], [0.0, 0.1]])))
    decaying = own_condition(kind(replace(linear_pendulum(), A=np.array([[0.1, 0.0], [0.0, -0.1]]))))
    assert decaying.holds
    assert decaying.numbers["rank"] == 1


def test_a_nonlinear_model_that_is_blind_at_its_start_only_is_accepted() -> None:
    """``phi = x1 x2`` in the first row shows the second state wherever the first is not zero."""
    model = replace(pendulum(), A=np.zeros((2, 2)), phi=lambda x, _u: vector(x[0] * x[1], 0.1 * x[1]))
    model = replace(model, states=tuple(replace(s, start=0.0) for s in model.states))
    ExtendedKalmanFilter(model)
    with pytest.raises(UnobservableError, match="rate"):
        ExtendedKalmanFilter(replace(model, phi=lambda x, _u: vector(0.0 * x[0], 0.1 * x[1])))


# -- what they refuse
# ---------------------------------------------------------------------------------------------------


def test_models_that_do_not_suit() -> None:
    with pytest.raises(ValueError, match=r"kalman_filter: model 'pendulum' is nonlinear: .*'extended_kalman_filter'"):
        KalmanFilter("pendulum")
    with pytest.raises(ValueError, match=r"'extended_luenberger'"):
        DiscreteLuenberger("pendulum")
    with pytest.raises(UnobservableError, match=r"angle"):
        ExtendedLuenberger(replace(linear_pendulum(), C=np.array([[0.0, 1.0]]), A=np.array([[0.0, 1.0], [0.0, -0.2]])))
    oscillator = replace(linear_pendulum(), A=np.array([[0.0, 1.0], [-(np.pi**2), 0.0]]), sample_period=1.0)
    with pytest.raises(UnobservableError, match=r"every 1 s are in step with an oscillation"):
        DiscreteLuenberger(oscillator)
    assert own_condition(ExtendedLuenberger(freight_train())).holds
