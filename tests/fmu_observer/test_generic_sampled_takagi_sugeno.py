"""Takagi-Sugeno observers with the innovation held: convergence, frozen weights, and certificates against exact
products.
"""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from own_condition import own_condition
from sampled_runner import SampledRunner, aperiodic_instants, true_motion
from scipy.linalg import expm

from fmu_observer.certificates.gap_findings import CONSTANT_GAP, GROWTH
from fmu_observer.models.exhibits.pendulum_model import pendulum
from fmu_observer.models.known_models import find_takagi_sugeno_model
from fmu_observer.observers.generic.sampled import TakagiSugenoAperiodic, TakagiSugenoPeriodic

TORQUE = 0.2
SWING = true_motion(pendulum(), (1.0, 0.5), (TORQUE,), 20.0)
REST = true_motion(pendulum(), (np.arcsin(TORQUE), 0.0), (TORQUE,), 20.0)  # where the torque holds the pendulum


def test_weights_of_the_estimate_let_the_error_die() -> None:
    runner = SampledRunner(TakagiSugenoPeriodic(), SWING, (TORQUE,))
    runner.follow(0.1 * np.arange(1, 101))
    assert np.abs(runner.error()).max() < 1e-6


def test_frozen_weights_leave_an_error_while_the_pendulum_swings_and_none_at_rest() -> None:
    instants = aperiodic_instants(0, 0.3, 19.0)
    swinging, resting = (SampledRunner(TakagiSugenoAperiodic(), motion, (TORQUE,)) for motion in (SWING, REST))
    swinging.follow(instants[instants < 6.0])
    assert 1e-6 < np.abs(swinging.error()).max() < 1e-2
    resting.follow(instants)
    assert np.abs(resting.error()).max() < 1e-8


def test_weights_and_innovation_change_at_samples_only() -> None:
    runner = SampledRunner(TakagiSugenoAperiodic(), SWING, (TORQUE,))
    runner.sample(0.3)
    held = runner.runtime.x[2:].copy()
    assert held[1] + held[2] == pytest.approx(1.0, abs=1e-15)
    runner.runtime.advance(0.7)
    np.testing.assert_array_equal(runner.runtime.x[2:], held)
    runner.sample(0.71)
    assert np.all(runner.runtime.x[2:5] != held[:3])


def test_the_flow_uses_the_frozen_weights() -> None:
    observer = TakagiSugenoAperiodic()
    p, u = observer.start_parameters(), np.array([TORQUE, 0.0])
    x = np.array([2.0, 0.3, 0.1, 0.25, 0.75, 0.0])  # weights that are not those of the angle 2, no sample missed
    (A1, A2), (L1, L2), B = observer.model.A, observer.gains(observer.unpack_parameters(p)), observer.model.B[0]
    expected = (0.25 * A1 + 0.75 * A2) @ x[:2] + B[:, 0] * TORQUE - (0.25 * L1 + 0.75 * L2)[:, 0] * 0.1
    np.testing.assert_allclose(observer.state_derivative(0.0, x, u, p), expected, rtol=1e-14)


def test_the_correction_pulls_towards_the_measurement() -> None:
    """The repaired sign: an angle measured above the estimate raises it."""
    for make in (TakagiSugenoPeriodic, TakagiSugenoAperiodic):
        runner = SampledRunner(make(), SWING, (TORQUE,))
        runner.sample(0.1)
        runner.runtime.advance(0.15)
        assert abs(runner.error()[0]) < abs((-SWING(0.15))[0])


@settings(max_examples=40)
@given(
    relative=st.lists(st.tuples(st.floats(0.001, 1.0), st.floats(0.0, 1.0)), min_size=5, max_size=40),
    angle=st.floats(0.0, np.pi),
)
def test_the_certified_function_falls_at_every_gap_and_weight(
    relative: list[tuple[float, float]], angle: float
) -> None:
    """Weights of the four mixtures' whole range, gaps on no grid, exact exponentials of the vertices' own equations."""
    observer, model = TakagiSugenoAperiodic(), find_takagi_sugeno_model("pendulum")
    limit = 0.999 * next(observer.findings(0.1)).limit
    P = np.array(next(observer.findings(limit)).lyapunov_matrix)
    gains = observer.gains(observer.unpack_parameters(observer.start_parameters()))
    e, levels = np.array([np.cos(angle), 2.0 * np.sin(angle)]), []
    for gap, h in relative:
        levels.append(float(e @ P @ e))
        A, L = h * model.A[0] + (1.0 - h) * model.A[1], h * gains[0] + (1.0 - h) * gains[1]
        generator = np.block([[A, -L], [np.zeros((1, 3))]])
        e = (expm(generator * gap * limit) @ np.r_[e, e[0]])[:2]
    assert all(after < before for before, after in pairwise(levels))


def test_beyond_the_constant_limit_the_error_grows() -> None:
    observer = TakagiSugenoPeriodic()
    certificate = next(observer.findings(0.1))
    beyond = next(observer.findings(1.05 * certificate.condition(CONSTANT_GAP).limit))
    assert beyond.numbers[GROWTH] > 1.0
    assert not beyond.holds


def test_the_gains_place_equal_poles_at_every_vertex() -> None:
    observer = TakagiSugenoPeriodic()
    for A, L in zip(
        observer.model.A, observer.gains(observer.unpack_parameters(observer.start_parameters())), strict=True
    ):
        np.testing.assert_allclose(sorted(np.linalg.eigvals(A - L @ observer.model.C).real), [-2.5, -2.0], atol=1e-9)


def test_the_condition_states_the_slope_it_tolerates() -> None:
    condition = own_condition(TakagiSugenoPeriodic())
    assert condition.holds
    # no less than the slowest pole can bear, no more than it could
    assert 0.1 < condition.numbers["tolerated_slope"] < 2.0
    wrong = own_condition(TakagiSugenoPeriodic(), {"gain": [-1.0, 0.0, -1.0, 0.0]})
    assert not wrong.holds
    assert wrong.numbers["tolerated_slope"] == 0.0


def test_the_train_is_notified_of_balises() -> None:
    observer = TakagiSugenoAperiodic("takagi_sugeno_train")
    assert [e.name for e in observer.triggered_events] == ["balise"]
    assert next(observer.findings(0.5)).holds
