"""The pendulum on a cart beside both filters: they agree, and their covariances fit; the regulator fed by one (LQG)."""

import numpy as np
import pytest
import scipy.linalg
import scipy.signal

from cosim import Scenario
from plant_models.exhibits import CartDoublePendulum, CartPendulum, StateFeedback
from plant_models.hybrid import HybridSystem
from plant_models.interop import to_state_space

pytestmark = pytest.mark.compiler


def test_both_filters_are_consistent_and_equal_at_one_millisecond() -> None:
    scenario = Scenario.load("pendulum_filters")
    outcome = scenario.run(warn=lambda _text: None)
    assert outcome.failure is None
    assert all(evaluated.passed for evaluated in outcome.expectations)
    found = {(c["observer"], c["quantity"]): c for c in outcome.result.summary["consistency"]}
    assert {found[name, "NIS"]["verdict"] for name in ("ekf", "ukf")} == {"consistent"}
    assert not [w for w in outcome.result.summary["warnings"] if "confident" in w]
    states = ("position", "speed", "angle", "rate")
    squares = [
        sum(float(np.mean(np.square(outcome[f"{name}.{s}"] - outcome[f"plant.{s}"]))) for s in states)
        for name in ("ekf", "ukf")
    ]
    assert squares[1] == pytest.approx(squares[0], rel=0.02)  # the claim of the thesis is not seen at this rate


def linear_deviations(plant: HybridSystem, process: float, reading: float, T: float = 1e-3) -> np.ndarray:
    """Standard deviations of the states with LQR and with LQG by linear theory, shape (2, n)."""
    linear = to_state_space(plant, preset="upright")
    n = linear.nstates
    A, B, *_ = scipy.signal.cont2discrete((linear.A, linear.B, np.eye(n), np.zeros((n, 1))), T)
    closed, C = A - B @ StateFeedback(plant.name).start_parameters()[np.newaxis, :n], np.eye(n)[::2]
    known = scipy.linalg.solve_discrete_lyapunov(closed, process * np.eye(n))
    P = scipy.linalg.solve_discrete_are(A.T, C.T, process * np.eye(n), reading * np.eye(n // 2))
    S = C @ P @ C.T + reading * np.eye(n // 2)
    L = P @ C.T @ np.linalg.inv(S)
    # the estimate moves by the innovations, its error is that of the filter, and the two are independent
    reported = scipy.linalg.solve_discrete_lyapunov(closed, L @ S @ L.T) + P - L @ C @ P
    return np.sqrt([np.diag(known), np.diag(reported)])


def test_a_regulator_fed_by_a_filter_holds_as_linear_theory_says() -> None:
    """Over 19.5 s rms of angle and rates lie within 35 % of theory on each of 12 seeds tried."""
    outcome = Scenario.load("pendulum_lqg").set("stop", 20.0).run(warn=lambda _text: None)
    assert outcome.failure is None
    assert all(evaluated.passed for evaluated in outcome.expectations)
    cases = (
        (CartPendulum(), 1e-6, 1e-2, ("known", "plant"), {2: "angle", 3: "rate"}),
        (CartDoublePendulum(), 1e-8, 1e-6, ("known_double", "double"), {3: "first_rate", 5: "second_rate"}),
    )
    for plant, process, reading, pair, states in cases:
        for component, deviations in zip(pair, linear_deviations(plant, process, reading), strict=True):
            for place, name in states.items():
                rms = float(np.sqrt(np.mean(np.square(outcome[f"{component}.{name}"][500:]))))
                assert rms == pytest.approx(deviations[place], rel=0.4), (component, name)
