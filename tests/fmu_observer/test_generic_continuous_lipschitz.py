"""Luenberger, Thau and high-gain observers: error equations, bounds, and what they refuse."""

from dataclasses import replace

import numpy as np
import pytest
from control import place_acker
from generic_runner import joint_errors
from hypothesis import given, settings
from hypothesis import strategies as st
from own_condition import own_condition
from scipy.linalg import expm

from fmu_observer.certificates.lipschitz_condition import _thau_bound, best_thau_bound
from fmu_observer.certificates.printed_bounds.high_gain_theta import (
    binomial_gain,
    lyapunov_size,
    theta_from_lipschitz,
    theta_from_slopes,
)
from fmu_observer.design.pole_placement import observer_gain
from fmu_observer.models.exhibits.pendulum_model import linear_pendulum, pendulum
from fmu_observer.models.scaled_slopes import scaled
from fmu_observer.observability import UnobservableError
from fmu_observer.observers.generic.continuous import HighGain, Luenberger, Thau
from plant_models.hybrid import input_signal, vector

CHAIN = np.diag(np.ones(1), 1)
FIRST = np.array([[1.0, 0.0]])
CLOSED = CHAIN - np.array([[4.0], [4.0]]) @ FIRST  # Thau's default gain


# -- Luenberger -------------------------------------------------------------------------------------------------------


def test_the_error_is_the_matrix_exponential() -> None:
    observer = Luenberger("linear_pendulum")
    model, start = observer.model, np.array([0.3, -0.2])
    L = observer.start_parameters()[:2, None]
    times = [0.1, 0.5, 1.0, 3.0]
    exact = [expm((model.A - L @ model.C) * t) @ (observer.start_state() - start) for t in times]
    np.testing.assert_allclose(joint_errors(observer, start, times), exact, atol=1e-11)  # the solver works at 1e-12


def test_the_default_poles() -> None:
    observer = Luenberger("linear_pendulum")
    closed = observer.model.A - observer.start_parameters()[:2, None] @ observer.model.C
    np.testing.assert_allclose(np.sort(np.linalg.eigvals(closed)), [-2.5, -2.0], rtol=1e-12)
    values = own_condition(observer).numbers
    assert (values["rank"], values["order"], values["abscissa"]) == (2, 2, pytest.approx(-2.0))


def test_the_condition_sees_a_gain_that_does_not_stabilise() -> None:
    assert not own_condition(Luenberger(), {"gain": [-1.0, 0.0]}).holds
    assert "DOES NOT HOLD" in own_condition(Luenberger(), {"gain": [-1.0, 0.0]}).explain()


@settings(max_examples=40, deadline=None)
@given(st.integers(2, 4), st.integers(0, 10_000))
def test_pole_placement_agrees_with_python_control(n: int, seed: int) -> None:
    generator = np.random.default_rng(seed)
    A, C = generator.normal(size=(n, n)), generator.normal(size=(1, n))
    poles = -1.0 - generator.uniform(0.0, 1.0, n)
    condition = np.linalg.cond(np.vstack([C @ np.linalg.matrix_power(A, k) for k in range(n)]))
    L = observer_gain(A, C, poles)
    # Both invert the observability matrix; their difference is its condition number in roundings.
    np.testing.assert_allclose(
        L[:, 0], np.ravel(place_acker(A.T, C.T, poles)), rtol=1e-12 * condition, atol=1e-12 * condition
    )


def test_several_measurements_and_repeated_poles() -> None:
    A = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.5]])
    two = observer_gain(A, np.eye(3)[:2], [-1.0, -2.0, -3.0])
    np.testing.assert_allclose(np.sort(np.linalg.eigvals(A - two @ np.eye(3)[:2]).real), [-3.0, -2.0, -1.0], rtol=1e-8)
    triple = observer_gain(A, np.eye(3)[:1], [-2.0, -2.0, -2.0])
    np.testing.assert_allclose(np.poly(A - triple @ np.eye(3)[:1]), [1.0, 6.0, 12.0, 8.0], rtol=1e-12)


def test_an_unobservable_mode_is_named() -> None:
    blind = replace(linear_pendulum(), C=np.array([[0.0, 1.0]]), A=np.array([[0.0, 1.0], [0.0, -0.2]]))
    with pytest.raises(UnobservableError, match=r"eigenvalue 0 .*angle"):
        Luenberger(blind)
    with pytest.raises(ValueError, match=r"poles of shape \(3,\), expected \(2,\)"):
        observer_gain(CHAIN, FIRST, [-1.0, -2.0, -3.0])


def test_a_gain_of_another_size_is_refused() -> None:
    with pytest.raises(ValueError, match=r"'gain' to certify needs 2 finite number"):
        own_condition(Luenberger(), {"gain": [1.0, 2.0, 3.0]})


# -- Thau -------------------------------------------------------------------------------------------------------------


def test_the_valid_and_the_printed_bound() -> None:
    """By hand: P = [[5/8, -1/2], [-1/2, 21/32]]. The independently measured numbers are 0.438 and 7.12."""
    middle, radius = 41.0 / 64.0, np.hypot(1.0 / 64.0, 0.5)
    assert _thau_bound(CLOSED) == pytest.approx((0.5 / (middle + radius), 1.0 / (middle - radius)), rel=1e-12)
    values = own_condition(Thau()).numbers
    assert values["bound"] == pytest.approx(0.438, abs=5e-4)
    assert values["printed_bound"] == pytest.approx(7.12, abs=5e-3)
    assert values["lipschitz"] == pytest.approx(np.hypot(1.0, 0.2))


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000))
def test_no_perturbation_below_the_valid_bound_destabilises(seed: int) -> None:
    perturbation = np.random.default_rng(seed).normal(size=(2, 2))
    perturbation *= 0.999 * _thau_bound(CLOSED)[0] / np.linalg.norm(perturbation, 2)
    assert np.linalg.eigvals(CLOSED + perturbation).real.max() < 0.0


def test_a_perturbation_far_below_the_printed_bound_destabilises() -> None:
    perturbation = np.array([[0.0, 0.0], [4.1, 0.0]])
    assert np.linalg.norm(perturbation, 2) < 0.6 * _thau_bound(CLOSED)[1]
    assert np.linalg.eigvals(CLOSED + perturbation).real.max() > 0.0


def test_scaled_coordinates_prove_the_pendulum_and_the_error_decays_everywhere() -> None:
    observer = Thau()
    values = own_condition(observer).numbers
    assert own_condition(observer).holds
    assert values["lipschitz"] > values["bound"]  # not in the model's own coordinates
    best = best_thau_bound(observer.model, np.array([[4.0], [4.0]]))
    closed = scaled(CLOSED, best.scale)
    S = np.diag([1.0, best.scale])
    np.testing.assert_allclose(closed, np.linalg.inv(S) @ CLOSED @ S, rtol=1e-12)
    for angle in np.linspace(-4.0, 4.0, 9):
        perturbed = closed + scaled(np.array([[0.0, 0.0], [-np.cos(angle), -0.2]]), best.scale)
        assert np.linalg.eigvals(perturbed).real.max() < 0.0
    for start in ([3.0, 0.0], [-2.0, 4.0], [0.5, -6.0]):
        errors = joint_errors(observer, np.array(start), [0.01, 8.0])
        assert np.linalg.norm(errors[1]) < 1e-4 * np.linalg.norm(errors[0])


def test_thau_needs_a_hurwitz_matrix() -> None:
    assert _thau_bound(CHAIN) == (0.0, 0.0)
    assert not own_condition(Thau(), {"gain": [0.0, 0.0]}).holds


# -- high gain --------------------------------------------------------------------------------------------------------


def test_the_smallest_theta_by_hand() -> None:
    """K = (2, 1): P = [[1/2, -1/2], [-1/2, 3/2]], largest eigenvalue 1 + sqrt(1/2)."""
    size = 1.0 + np.sqrt(0.5)
    assert lyapunov_size(binomial_gain(2)) == pytest.approx(size, rel=1e-12)
    assert theta_from_lipschitz(pendulum(), binomial_gain(2)) == pytest.approx(
        2.0 * np.sqrt(2.0) * size * np.hypot(1.0, 0.2)
    )
    # With the slopes: theta > 2 lmax(P) hypot(1 / theta, 0.2), a quadratic equation in theta squared.
    c = (2.0 * size) ** 2
    exact = np.sqrt(0.5 * (0.04 * c + np.sqrt((0.04 * c) ** 2 + 4.0 * c)))
    found = theta_from_slopes(pendulum(), binomial_gain(2))
    assert exact <= found <= exact * 1.003  # one step of the grid


def test_the_condition_turns_at_the_smallest_theta() -> None:
    smallest = own_condition(HighGain()).numbers["smallest_theta"]
    assert own_condition(HighGain()).holds
    assert own_condition(HighGain(), {"theta": 1.001 * smallest}).holds
    assert not own_condition(HighGain(), {"theta": 0.999 * smallest}).holds
    assert not own_condition(HighGain(), {"high_gain": [-2.0, 1.0]}).holds


@settings(max_examples=40, deadline=None)
@given(st.floats(1.0, 20.0), st.floats(-1.0, 1.0), st.integers(2, 4))
def test_above_the_smallest_theta_the_frozen_error_decays(factor: float, slope: float, n: int) -> None:
    K = binomial_gain(n)
    last = np.zeros((n, n))
    last[-1, 0], last[-1, -1] = slope, -0.2
    model = replace(
        pendulum(),
        states=tuple(replace(pendulum().states[0], name=f"x{i}") for i in range(n)),
        A=np.diag(np.ones(n - 1), 1),
        B=np.eye(n)[:, -1:],
        C=np.eye(n)[:1],
        phi=lambda x, _u: last @ x,
        slopes=(last,),
        lipschitz=float(np.linalg.norm(last, 2)),
    )
    for smallest in (theta_from_lipschitz(model, K), theta_from_slopes(model, K)):
        theta = factor * smallest
        closed = model.A + last - np.outer(theta ** np.arange(1, n + 1) * K, np.eye(n)[0])
        assert np.linalg.eigvals(closed).real.max() < 0.0


def test_convergence_in_the_order_of_what_was_measured_elsewhere() -> None:
    """On another pendulum, whose parameters are not printed: 6.0e-2, 7.9e-5, 4.7e-9 at 2, 5 and 10 s. Ours: a factor of
    ten.
    """
    errors = np.linalg.norm(joint_errors(HighGain(), np.array([1.0, 0.0]), [2.0, 5.0, 10.0], theta=2.0), axis=1)
    assert np.all(np.abs(np.log10(errors / [6.0e-2, 7.9e-5, 4.7e-9])) < 1.0)
    fast = np.linalg.norm(joint_errors(HighGain(), np.array([1.0, 0.0]), [2.0, 5.0]), axis=1)
    assert fast[0] < 1e-3
    assert fast[1] < 1e-9


def test_models_that_do_not_suit_the_high_gain_observer() -> None:
    with pytest.raises(ValueError, match=r"'linear_pendulum' is not in the normal form .*shift matrix"):
        HighGain("linear_pendulum")
    upper = replace(pendulum(), phi=lambda x, _u: vector(0.1 * x[1], -np.sin(x[0])))
    with pytest.raises(ValueError, match=r"phi of 'angle' must not depend on 'rate'"):
        HighGain(upper)
    both = replace(pendulum(), C=np.eye(2), measurements=(*pendulum().measurements, input_signal("rate", "rad/s")))
    with pytest.raises(ValueError, match=r"2 measurements, expected one"):
        HighGain(both)
    with pytest.raises(ValueError, match=r"first state must be measured"):
        HighGain(replace(pendulum(), C=np.array([[2.0, 0.0]])))
