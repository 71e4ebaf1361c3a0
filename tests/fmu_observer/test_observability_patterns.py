"""The Gramian over a pattern of samples: closed forms, quadrature, and what must hold for every pattern."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad_vec
from scipy.linalg import expm, solve_continuous_lyapunov

from fmu_observer.models.train.freight_train_model import freight_train
from fmu_observer.observability import (
    MeasuredSystem,
    SamplePattern,
    UnobservableError,
    measured_model,
    observability,
    observability_gramian,
)
from fmu_observer.observability.modes import unobservable_subspace

INTEGRATOR = np.array([[0.0, 1.0], [0.0, 0.0]])  # position, speed
OSCILLATOR = np.array([[0.0, 1.0], [-1.0, 0.0]])
POSITION, SPEED = [[1.0, 0.0]], [[0.0, 1.0]]
INSTANTS = st.lists(st.floats(0.0, 10.0), min_size=1, max_size=8, unique=True).map(sorted)

# -- closed forms ---------------------------------------------------------------------------------------------------


@given(INSTANTS)
def test_balises_under_a_train_that_rolls_have_the_textbook_gramian(instants: list[float]) -> None:
    t = np.array(instants)
    found = observability_gramian(MeasuredSystem(INTEGRATOR, C_sampled=POSITION), SamplePattern(t))
    np.testing.assert_allclose(found, [[len(t), t.sum()], [t.sum(), (t**2).sum()]], rtol=1e-12, atol=1e-12)


@given(end=st.floats(0.1, 20.0), instants=INSTANTS)
def test_an_odometer_adds_what_it_integrates(end: float, instants: list[float]) -> None:
    t = np.array([i for i in instants if i <= end])
    position = observability_gramian(MeasuredSystem(INTEGRATOR, C_continuous=POSITION), SamplePattern([], end))
    np.testing.assert_allclose(position, [[end, end**2 / 2.0], [end**2 / 2.0, end**3 / 3.0]], rtol=1e-12)
    both = observability_gramian(MeasuredSystem(INTEGRATOR, SPEED, POSITION), SamplePattern(t, end))
    np.testing.assert_allclose(both, [[len(t), t.sum()], [t.sum(), (t**2).sum() + end]], rtol=1e-12, atol=1e-12)


def test_the_gramian_is_the_integral() -> None:
    A = np.array([[0.1, 1.0, 0.0], [-2.0, -0.3, 0.5], [0.0, 0.2, 0.4]])  # grows and swings
    C, t = np.array([[1.0, 0.0, -1.0]]), np.array([0.7, 1.1, 2.6])
    found = observability_gramian(MeasuredSystem(A, C, 2.0 * C), SamplePattern(t, 3.0))
    rows = [2.0 * C @ expm(A * s) for s in t]
    expected = quad_vec(lambda s: expm(A.T * s) @ C.T @ C @ expm(A * s), 0.0, 3.0, epsabs=1e-13, epsrel=1e-13)[0]
    np.testing.assert_allclose(found, expected + sum(row.T @ row for row in rows), rtol=1e-11)


def test_a_stiff_system_over_a_long_time_reaches_the_lyapunov_solution() -> None:
    A = np.array([[-1577.0, 30.0], [0.5, -0.8]])
    C = np.array([[1.0, 2.0]])
    found = observability_gramian(MeasuredSystem(A, C), SamplePattern([], 90.0))
    np.testing.assert_allclose(found, solve_continuous_lyapunov(A.T, -C.T @ C), rtol=1e-9)


# -- laws -----------------------------------------------------------------------------------------------------------


@settings(max_examples=60)
@given(instants=INSTANTS, more=st.floats(0.0, 10.0), damping=st.floats(-0.2, 0.5), frequency=st.floats(0.0, 3.0))
def test_one_balise_more_never_lowers_the_smallest_singular_value(
    instants: list[float], more: float, damping: float, frequency: float
) -> None:
    system = MeasuredSystem([[0.0, 1.0], [-(frequency**2), -damping]], C_sampled=POSITION)
    before = observability(system, SamplePattern(instants, 10.0))
    after = observability(system, SamplePattern(sorted({*instants, more}), 10.0))
    assert after.smallest_singular_value >= before.smallest_singular_value - 1e-12 * after.singular_values[0]
    assert after.rank >= before.rank


@settings(max_examples=60)
@given(seed=st.integers(0, 10**6), n=st.integers(1, 4), continuous=st.booleans(), hidden=st.booleans())
def test_enough_samples_at_irregular_instants_show_what_the_rank_condition_says(
    seed: int, n: int, continuous: bool, hidden: bool
) -> None:
    draw = np.random.default_rng(seed)
    A, C = draw.normal(size=(n, n)), draw.normal(size=(1, n))
    if hidden:
        A[:-1, -1], C[0, -1] = 0.0, 0.0  # the last state acts on nothing that is measured
    system = MeasuredSystem(A, C if continuous else None, None if continuous else C)
    gaps = draw.uniform(0.05, 0.2, 4 * n)
    found = observability(system, SamplePattern(np.cumsum(gaps)))
    assert found.rank == n - unobservable_subspace(A, C).basis.shape[1] == n - hidden
    assert found.observable == (not found.unobservable)


@settings(max_examples=30)
@given(instants=INSTANTS, scale=st.floats(1e-3, 1e3))
def test_scales_only_change_the_units(instants: list[float], scale: float) -> None:
    plain = MeasuredSystem(INTEGRATOR, SPEED, POSITION)
    scaled = MeasuredSystem(INTEGRATOR, SPEED, POSITION, scales=[scale, 2.0])
    pattern = SamplePattern(instants, 10.0)
    S = np.diag([scale, 2.0])
    expected = S @ observability(plain, pattern).gramian @ S
    found = observability(scaled, pattern)
    np.testing.assert_allclose(found.gramian, expected, rtol=1e-9, atol=1e-12 * expected.max())
    assert found.rank == 2


# -- what a pattern misses ------------------------------------------------------------------------------------------


def test_samples_in_step_with_an_oscillation_miss_half_of_it() -> None:
    system = MeasuredSystem(OSCILLATOR, C_sampled=POSITION, states=["swing", "rate"], name="coupler")
    in_step = observability(system, SamplePattern(np.pi * np.arange(1, 6)))
    assert (in_step.rank, in_step.unobservable) == (1, ())
    np.testing.assert_allclose(np.abs(in_step.unseen[:, 0]), [0.0, 1.0], atol=1e-9)
    with pytest.raises(
        UnobservableError, match=r"coupler: 5 samples .* show 1 of 2 states; not measured: \+?-?1 rate.*in step"
    ):
        in_step.require()
    observability(system, SamplePattern(0.9 * np.pi * np.arange(1, 6))).require()


def test_one_balise_does_not_show_the_speed() -> None:
    train = measured_model(freight_train(), x0=[0.0, 13.9])
    one = observability(train, SamplePattern.of_balises([100.0], 13.9))
    assert (one.rank, one.smallest_singular_value == pytest.approx(0.0, abs=1e-12)) == (1, True)
    assert "too few" in one.explain()
    two = observability(train, SamplePattern.of_balises([100.0, 200.0], 13.9))
    assert two.observable
    assert "smallest singular value" in two.explain()


def test_what_dies_out_before_the_first_balise_is_said_to_do_so() -> None:
    system = MeasuredSystem(np.diag([0.0, -1500.0]), C_sampled=[[1.0, 1.0]], states=["place", "creep"])
    found = observability(system, SamplePattern([1.0, 2.0]))
    assert (found.rank, found.undetectable) == (1, ())
    assert found.remaining < 1e-100
    assert "creep" in found.explain()
    assert "dies out" in found.explain()


def test_a_hidden_offset_is_named_by_the_pattern_too() -> None:
    blind = observability(MeasuredSystem(INTEGRATOR, SPEED, states=["position", "speed"]), SamplePattern([], 5.0))
    assert blind.remaining == pytest.approx(1.0)
    with pytest.raises(UnobservableError, match=r"No pattern would show: eigenvalue 0 1/s .*position \(1\)") as error:
        blind.require()
    assert len(error.value.modes) == 1


# -- patterns -------------------------------------------------------------------------------------------------------


def test_balises_become_the_instants_of_crossing() -> None:
    forward = SamplePattern.of_balises([300.0, 100.0, 50.0], 10.0, start=60.0)  # the one at 50 m lies behind
    np.testing.assert_allclose(forward.instants, [4.0, 24.0])
    np.testing.assert_allclose(forward.gaps, [4.0, 20.0, 0.0])
    back = SamplePattern.of_balises([300.0, 100.0, 50.0], -10.0, start=200.0, duration=12.0)
    np.testing.assert_allclose(back.instants, [10.0])
    assert back.duration == 12.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([100.0, 250.0, 100.0], 10.0), r"two balises at one place: numbers 1 and 3 at 100 m.*list the place once"),
        (([100.0], 0.0), r"speed must be finite and not zero"),
        (([100.0, np.inf], 1.0), r"every position must be a finite number"),
        (([100.0], -5.0), r"from 0 m at -5 m/s no balise is passed"),
    ],
)
def test_impossible_balises_are_refused(arguments: tuple, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        SamplePattern.of_balises(*arguments)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([1.0, 1.0],), r"one sample at a time: number 2 at 1 s follows number 1 at 1 s"),
        (([-1.0, 1.0],), r"-1 s to 1 s is not within the window 0 s to 1 s"),
        (([1.0, 2.0], 1.5), r"is not within the window 0 s to 1.5 s"),
        (([np.nan], 1.5), r"must be finite"),
    ],
)
def test_impossible_instants_are_refused(arguments: tuple, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        SamplePattern(*arguments)
