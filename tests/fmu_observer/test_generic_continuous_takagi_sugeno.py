"""The Takagi-Sugeno Luenberger observer: its error equation and its inequalities."""

from dataclasses import replace

import numpy as np
import pytest
from own_condition import own_condition
from scipy.integrate import solve_ivp

from fmu_observer.models.known_models import find_takagi_sugeno_model
from fmu_observer.observability import UnobservableError
from fmu_observer.observers.generic.continuous import TakagiSugenoLuenberger
from fmu_observer.observers.generic.continuous.takagi_sugeno_luenberger import (
    _placed_gains,
    _vertex_decrease,
    vertex_errors,
)

POLES = np.array([-2.0, -2.5])


def joint(observer: TakagiSugenoLuenberger, start: np.ndarray, times: list[float]) -> np.ndarray:
    """Estimate minus state of the model at the times, the torque sin(t)."""
    model, n = observer.model, observer.model.order
    p = observer.start_parameters()

    def flow(t: float, x: np.ndarray) -> np.ndarray:
        known = np.sin(t) * np.ones(len(model.inputs))
        u = np.concatenate([known, model.C @ x[:n]])
        return np.concatenate([model.flow(x[:n], known), observer.state_derivative(t, x[n:], u, p)])

    solution = solve_ivp(
        flow, (0.0, times[-1]), np.append(start, observer.start_state()), rtol=1e-11, atol=1e-13, t_eval=times
    )
    return np.asarray(solution.y[n : 2 * n] - solution.y[:n]).T


def test_the_error_is_that_of_the_blended_vertices() -> None:
    """For the pendulum placed gains make all vertices one matrix, whatever the premise: its exponential is the
    error.
    """
    observer, start = TakagiSugenoLuenberger(), np.array([2.5, -1.0])
    errors = joint(observer, start, [0.5, 1.0, 3.0])
    closed = vertex_errors(observer.model, _placed_gains(observer.model, POLES))
    np.testing.assert_allclose(closed[0], closed[1], atol=1e-12)
    values, vectors = np.linalg.eig(closed[0])
    for t, error in zip([0.5, 1.0, 3.0], errors, strict=True):
        exact = np.real(vectors @ np.diag(np.exp(values * t)) @ np.linalg.inv(vectors)) @ -start
        np.testing.assert_allclose(error, exact, atol=1e-9)


def test_estimated_premises_are_another_observer_that_converges_too() -> None:
    start = np.array([2.5, -1.0])
    measured, estimated = (
        joint(TakagiSugenoLuenberger(premise=p), start, [0.5, 6.0]) for p in ("measured", "estimated")
    )
    assert np.abs(measured[0] - estimated[0]).max() > 1e-3
    assert np.abs(estimated[1]).max() < 1e-3
    condition = own_condition(TakagiSugenoLuenberger(premise="estimated"))
    assert not condition.holds  # the inequalities say nothing of it
    assert condition.numbers["premises_not_measured"] == 1


def test_equal_poles_at_the_vertices_are_not_enough() -> None:
    """The first example of chapter 2: every vertex has its poles at -2 and beyond, and no common P exists."""
    model = find_takagi_sugeno_model("triangularisable_example")
    placed = own_condition(TakagiSugenoLuenberger(model))
    assert placed.numbers["abscissa"] == pytest.approx(-2.0, abs=1e-6)
    assert not placed.holds


def test_the_printed_order_of_the_product_is_no_inequality() -> None:
    """(1.26) prints L_i' C'; for one measurement and two states the shapes do not even agree."""
    model = find_takagi_sugeno_model("pendulum")
    L = _placed_gains(model, POLES)[0]
    with pytest.raises(ValueError, match="mismatch"):
        L.T @ model.C
    assert (model.C.T @ L.T).shape == (2, 2)


def test_bad_input() -> None:
    model = find_takagi_sugeno_model("pendulum")
    with pytest.raises(ValueError, match=r"gain has shape \(2, 2\), expected \(2, 2, 1\)"):
        TakagiSugenoLuenberger(gains=np.ones((2, 2)))
    with pytest.raises(ValueError, match=r"unknown premise 'frozen'; choose one of: measured, estimated"):
        TakagiSugenoLuenberger(premise="frozen")  # type: ignore[arg-type]
    blind = replace(model, A=np.stack([np.array([[0.0, 0.0], [s, -0.2]]) for s in (-1.0, 0.2)]))
    with pytest.raises(UnobservableError, match=r"vertex 1: .*rate"):
        TakagiSugenoLuenberger(blind)


def test_time_outside_the_bounds_is_counted() -> None:
    model = find_takagi_sugeno_model("pendulum")
    narrow = replace(model, premises=(replace(model.premises[0], low=0.9, high=1.0),))
    observer = TakagiSugenoLuenberger(narrow)
    p, u = observer.start_parameters(), np.zeros(2)
    for angle, outside in ((0.1, 0.0), (1.5, 1.0)):  # sin(1.5) / 1.5 = 0.66
        u[1] = angle
        assert observer.state_derivative(0.0, observer.start_state(), u, p)[-1] == outside


def test_the_margin_by_hand() -> None:
    """``A = -I``: P = I is best and leaves -2. Two shears whose mean is unstable have no common P, stable as each
    is.
    """
    model, none = find_takagi_sugeno_model("pendulum"), np.zeros((2, 2, 1))
    assert _vertex_decrease(replace(model, A=np.stack([-np.eye(2)] * 2)), none).margin == pytest.approx(2.0, rel=1e-6)
    shear = np.array([[-1.0, 10.0], [0.0, -1.0]])
    found = _vertex_decrease(replace(model, A=np.stack([shear, shear.T])), none)
    assert found.abscissa == pytest.approx(-1.0)
    assert found.margin <= 1e-6  # of the solver's accuracy
