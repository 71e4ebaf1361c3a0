"""The decaying innovation as a state equals the published gain exp(-theta K1 (t - t_k)), and the output predictor."""

from collections.abc import Callable

import numpy as np
import pytest
from observer_runner import DAVIS_A, DAVIS_B, DAVIS_C, MASS, SteadyMotion, in_step
from scipy.integrate import solve_ivp
from scipy.linalg import solve_continuous_lyapunov

from fmu_observer.formulas.correction.innovation_decay import HIGH_GAIN_K
from fmu_observer.observers.train import DifferentiatorCdo, MultirateCdo, TakagiSugenoCdo, TrainObserver

MOTION = SteadyMotion(speed=20.0)
GAPS = (0.31, 0.48, 0.12, 0.5, 0.27, 0.44)
START = (3.0, 18.5)  # position and speed estimates, wrong on purpose; the speed stays positive
RK4_ACCURACY = 1e-9  # fourth order at 1 ms and rates of 16 1/s: (0.016)^4 / 120 a second, on errors of order one

Drift = Callable[[np.ndarray], np.ndarray]


def train(state: np.ndarray, force: float) -> np.ndarray:
    v = state[1]
    return np.array([v, (force - DAVIS_A - DAVIS_B * v - DAVIS_C * v * abs(v)) / MASS])


def published(drift: Drift, gain: np.ndarray, decay: float) -> np.ndarray:
    """Equation (1.47) as printed: explicit time since the last balise, gap by gap."""
    state, t_k, innovation = np.array(START), 0.0, 0.0
    for gap in GAPS:
        held = innovation

        def rhs(t: float, x: np.ndarray, held: float = held) -> np.ndarray:
            return drift(x) - gain * np.exp(-decay * t) * held

        state = solve_ivp(rhs, (0.0, gap), state, rtol=1e-12, atol=1e-12).y[:, -1]
        t_k += gap
        innovation = state[0] - MOTION.position(t_k)
    return state


def output_predictor(drift: Drift, gain: np.ndarray) -> np.ndarray:
    """The predictor form: ``dw`` is the model's own output rate, reset to the measurement at a balise."""
    state, t_k = np.array([*START, START[0]]), 0.0

    def rhs(_t: float, x: np.ndarray) -> np.ndarray:
        rate = drift(x[:2])
        return np.array([*(rate - gain * (x[0] - x[2])), rate[0]])

    for gap in GAPS:
        state = solve_ivp(rhs, (0.0, gap), state, rtol=1e-12, atol=1e-12).y[:, -1]
        t_k += gap
        state[2] = MOTION.position(t_k)
    return np.asarray(state[:2])


def observed(observer: TrainObserver) -> np.ndarray:
    runner = in_step(observer, MOTION)
    runner.set("x", {"estimated_position": START[0], "estimated_speed": START[1]})
    runner.runtime.start(0.0)
    runner.follow(MOTION, GAPS)
    return np.array([runner.state("estimated_position"), runner.state("estimated_speed")])


@pytest.mark.parametrize("make", [DifferentiatorCdo, MultirateCdo], ids=lambda m: m.name)
def test_the_decaying_state_is_the_published_gain(make: type[TrainObserver]) -> None:
    theta, gain = 8.0, np.array([2.0 * 8.0, 8.0**2])
    force = MOTION.effort(0.0)
    expected = published(lambda x: train(x, force), gain, 2.0 * theta)
    np.testing.assert_allclose(observed(make()), expected, atol=RK4_ACCURACY)


def test_the_decaying_state_is_the_output_predictor() -> None:
    force = MOTION.effort(0.0)
    expected = output_predictor(lambda x: train(x, force), np.array([16.0, 64.0]))
    np.testing.assert_allclose(observed(DifferentiatorCdo()), expected, atol=RK4_ACCURACY)


def test_the_takagi_sugeno_innovation_is_the_published_gain() -> None:
    weight = (50.0 - 20.0) / 45.0  # after the first balise; before it the innovation is zero and only the drag differs
    slope = (DAVIS_B + DAVIS_C * (weight * 5.0 + (1.0 - weight) * 50.0)) / MASS
    gain = np.array([9.9036, weight * 25.4133 + (1.0 - weight) * 25.4071])
    odometer_gain = -1e-4 * np.array([0.1618, weight * 0.0126 + (1.0 - weight) * 0.0130])

    def drift(x: np.ndarray) -> np.ndarray:
        model = np.array([x[1], (MOTION.effort(0.0) - DAVIS_A) / MASS - slope * x[1]])
        return np.asarray(model - odometer_gain * (x[1] - 20.0))

    np.testing.assert_allclose(
        observed(TakagiSugenoCdo(premise="live")), published(drift, gain, 9.9), atol=RK4_ACCURACY
    )


def test_the_gain_shape_solves_the_corrected_lyapunov_equation() -> None:
    shift, C = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[1.0, 0.0]])
    # (3.29) with A: P + A'P + PA = C'C, the same as (A + I/2)'P + P(A + I/2) = C'C
    P = solve_continuous_lyapunov((shift + 0.5 * np.eye(2)).T, C.T @ C)
    np.testing.assert_allclose(P, [[1.0, -1.0], [-1.0, 2.0]], atol=1e-12)
    np.testing.assert_allclose(np.linalg.solve(P, C.T)[:, 0], HIGH_GAIN_K, atol=1e-12)
    closed = shift - np.outer(HIGH_GAIN_K, C)  # as printed, with the closed matrix, P comes out negative definite
    printed = solve_continuous_lyapunov((closed + 0.5 * np.eye(2)).T, C.T @ C)
    assert np.linalg.eigvalsh(printed).max() < 0.0
