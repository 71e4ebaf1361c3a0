"""The multirate observer by a Sylvester equation: matrices, independent samples, convergence on an unstable plant."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from own_condition import own_condition
from sampled_runner import chain
from scipy.integrate import solve_ivp
from scipy.linalg import solve_continuous_are

from fmu_observer.models.exhibits.inverted_pendulum_on_cart import inverted_pendulum_cart
from fmu_observer.models.exhibits.pendulum_model import pendulum
from fmu_observer.observers.generic.sampled import MultirateSylvester
from fmu_observer.observers.generic.sampled.multirate_sylvester import (
    _sylvester_design,
    _sylvester_residual,
    _sylvester_transformation,
)
from plant_models.hybrid import NumpyKernel, Runtime, TracedSystem

MODEL = inverted_pendulum_cart()
START = np.array([0.3, 0.05, 0.2, 0.4, 0.1])
INPUTS = {"voltage": 0, "measured_current": 1, "position_sample_value": 2, "angle_sample_value": 3}


def joint_errors(ends: tuple[float, ...], position_gap: float, angle_gap: float, balanced: bool = True) -> list[float]:
    """Largest error at `ends`: plant and observer integrated together by DOP853 from sample to sample.

    Balanced by a state feedback of the true state, so that the size of the errors is not lost in that of the states.
    """
    observer = MultirateSylvester()
    P = solve_continuous_are(MODEL.A, MODEL.B, np.eye(5), np.eye(1))
    feedback = MODEL.B.T @ P if balanced else np.zeros((1, 5))
    p = observer.start_parameters()
    u, missed = np.zeros(4), np.zeros(1)

    def known(x: np.ndarray) -> None:
        u[0], u[1] = -(feedback @ x)[0], x[2]

    def flow(_t: float, both: np.ndarray) -> np.ndarray:
        known(both[:5])
        followed = observer.state_derivative(0.0, np.r_[both[5:], missed], u, p)
        return np.r_[MODEL.A @ both[:5] + MODEL.B @ u[:1], followed]

    instants = sorted(
        {round(k * gap, 9) for gap in (position_gap, angle_gap) for k in range(1, int(ends[-1] / gap) + 1)} | set(ends)
    )
    both, t, found = np.r_[START, observer.start_state()[: observer.continuous_count]], 0.0, []
    for end in instants:
        both = solve_ivp(flow, (t, end), both, "DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
        t = end
        if end in ends:
            known(both[:5])
            found.append(float(np.abs(observer.output_vector(t, np.r_[both[5:], missed], u, p) - both[:5]).max()))
        for event, gap, state in (("position_sample", position_gap, 3), ("angle_sample", angle_gap, 4)):
            if abs(end / gap - round(end / gap)) < 1e-6:
                u[INPUTS[f"{event}_value"]] = both[state]
                both[5:] = observer.jump_vector(event, t, np.r_[both[5:], missed], u, p)[:-1]
    return found


def test_the_sylvester_equation_is_solved_to_rounding() -> None:
    design = _sylvester_design(MODEL.A, 2, [-2.0, -2.5])
    r = len(design.A)
    error = design.T @ MODEL.A - design.A @ design.T - np.hstack([np.zeros((r, r)), design.B])
    # independently measured 4e-16 on another plant; here entries of 10 are subtracted
    assert np.abs(error).max() < 2e-14
    np.testing.assert_allclose(design.T[:, :r], np.eye(r), atol=1e-12)
    np.testing.assert_allclose(sorted(np.linalg.eigvals(design.A).real), [-2.5, -2.0], atol=1e-9)
    assert own_condition(MultirateSylvester()).numbers["residual"] < 2e-14


@settings(max_examples=40)
@given(seed=st.integers(0, 10**6), r=st.integers(1, 3), m=st.integers(1, 3))
def test_any_stable_filter_with_any_gain_has_its_transformation(seed: int, r: int, m: int) -> None:
    numbers = np.random.default_rng(seed)
    F = numbers.normal(size=(r + m, r + m))
    A = -np.diag(4.0 + numbers.uniform(0.0, 2.0, r)) - 4.0 * np.eye(r)
    B = numbers.normal(size=(r, m))
    assert _sylvester_residual(F, A, B, _sylvester_transformation(F, A, B)) < 1e-10


def test_a_filter_that_shares_an_eigenvalue_with_the_plant_is_refused() -> None:
    with pytest.raises(ValueError, match="shares an eigenvalue"):
        _sylvester_transformation(np.diag([-1.0, 2.0]), np.array([[-1.0]]), np.array([[1.0]]))
    with pytest.raises(ValueError, match="do not fit"):
        _sylvester_transformation(np.eye(3), np.eye(2), np.ones((2, 2)))


def test_the_error_dies_on_an_unstable_plant() -> None:
    """Independently measured 1.4e-4, 4.5e-9, 2.8e-13 at 2, 5, 12 s on a plant that is not printed: rates like ours or
    faster.
    """
    assert np.linalg.eigvals(MODEL.A).real.max() > 1.4
    errors = joint_errors((2.0, 5.0, 12.0), 0.1, 0.15)
    assert errors[0] < 1e-2
    assert errors[1] < 1e-4
    assert errors[2] < 1e-10


def test_the_error_does_not_depend_on_what_the_plant_does() -> None:
    free, balanced = (joint_errors((0.5, 2.0), 0.2, 0.25, balanced) for balanced in (False, True))
    np.testing.assert_allclose(free, balanced, rtol=1e-6)


def test_a_sample_sets_its_own_component_and_makes_the_estimate_jump() -> None:
    runtime = Runtime(MultirateSylvester(), NumpyKernel(MultirateSylvester()))
    names = [s.name for s in runtime.system.input_signals]
    assert names == list(INPUTS)
    runtime.start(0.0)
    before, output = runtime.x.copy(), runtime.update_outputs().copy()
    runtime.u[INPUTS["angle_sample_value"]] = 0.3
    runtime.trigger("angle_sample")
    assert np.flatnonzero(runtime.x != before).tolist() == [3]
    after = runtime.update_outputs()
    assert after[4] == 0.3
    assert after[3] == output[3]
    assert np.abs(after[:2] - output[:2]).max() > 0.1


def test_traced_and_plain_agree() -> None:
    TracedSystem(MultirateSylvester())
    traced, python = Runtime(MultirateSylvester()), Runtime(MultirateSylvester(), NumpyKernel(MultirateSylvester()))
    for runtime in (traced, python):
        runtime.u[:] = 1.0, 0.2, 0.1, 0.05
        runtime.start(0.0)
        for _ in range(3):
            runtime.advance(runtime.t + 0.1)
            runtime.trigger("position_sample")
    np.testing.assert_allclose(traced.x, python.x, rtol=1e-11)


def test_matrices_that_no_longer_fit_each_other_are_found() -> None:
    observer = MultirateSylvester()
    condition = own_condition(observer, {"filter_gain[1]": 5.0})
    assert not condition.holds
    assert condition.numbers["residual"] > 1e-3
    assert not next(observer.findings(0.1, {"filter_gain[1]": 5.0})).holds
    assert not own_condition(observer, {"filter_matrix": np.eye(2).ravel()}).holds


def test_one_sampled_output_needs_no_small_gain() -> None:
    notes = next(MultirateSylvester(continuous=2).findings(0.1)).remarks
    assert len(notes) == 1
    assert "small-gain" in next(MultirateSylvester().findings(0.1)).explain()


def test_models_that_do_not_suit_are_refused() -> None:
    with pytest.raises(ValueError, match="must be linear"):
        MultirateSylvester(pendulum())
    with pytest.raises(ValueError, match="last states measured"):
        MultirateSylvester(chain(2))
    with pytest.raises(ValueError, match="continuous must be 0 to 2"):
        MultirateSylvester(continuous=3)
    blind = MODEL.A.copy()
    blind[:, 0] = 0.0  # nothing tells of the speed of the cart
    with pytest.raises(ValueError, match=r"(?s)inverted_pendulum_cart.*speed"):
        MultirateSylvester(replace(MODEL, A=blind))
