"""The Takagi-Sugeno Luenberger observer: its error equation, its inequalities, its design."""

from dataclasses import replace

import numpy as np
import pytest
from own_condition import own_condition
from scipy.integrate import solve_ivp

from fmu_observer.models.known_models import TAKAGI_SUGENO_MODELS, find_takagi_sugeno_model
from fmu_observer.observability import UnobservableError
from fmu_observer.observers.generic.continuous import TakagiSugenoLuenberger
from fmu_observer.observers.generic.continuous.takagi_sugeno_luenberger import (
    _designed_gains,
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


@pytest.mark.parametrize("name", sorted(TAKAGI_SUGENO_MODELS))
def test_designed_gains_satisfy_the_inequalities_at_the_asked_decay(name: str) -> None:
    model = find_takagi_sugeno_model(name)
    gains = _designed_gains(model, decay=0.5)
    assert max(np.linalg.eigvals(error).real.max() for error in vertex_errors(model, gains)) < -0.5
    found = _vertex_decrease(model, gains)
    assert found.margin > 0.0
    observer = TakagiSugenoLuenberger(model, gains=gains)
    assert own_condition(observer).holds
    assert observer.start_parameters()[:-1] == pytest.approx(gains.ravel())


def test_equal_poles_at_the_vertices_are_not_enough_and_the_inequalities_are() -> None:
    """The first example of chapter 2: every vertex has its poles at -2 and beyond, and no common P exists."""
    model = find_takagi_sugeno_model("triangularisable_example")
    placed = own_condition(TakagiSugenoLuenberger(model))
    assert placed.numbers["abscissa"] == pytest.approx(-2.0, abs=1e-6)
    assert not placed.holds
    assert own_condition(TakagiSugenoLuenberger(model, gains=_designed_gains(model))).holds


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
    stuck = replace(model, A=np.stack([np.array([[0.0, 0.0], [s, 0.2]]) for s in (-1.0, 0.2)]))
    with pytest.raises(UnobservableError, match=r"design of pendulum, vertex 1: .*eigenvalue 0.2 1/s .*rate"):
        _designed_gains(stuck)


def test_an_infeasible_decay_is_refused_with_the_nearest_one() -> None:
    """The rate is not measured and decays with 0.2 1/s by itself: no gain makes it faster, every smaller decay can be
    had.
    """
    blind = replace(
        find_takagi_sugeno_model("pendulum"), A=np.stack([np.array([[0.0, 0.0], [s, -0.2]]) for s in (-1.0, 0.2)])
    )
    with pytest.raises(ValueError, match=r"no common P at the 2 vertices for decay 1 1/s. Nearest decay") as refused:
        _designed_gains(blind, 1.0)
    nearest = float(str(refused.value).split("found feasible: ")[1].split()[0])
    assert 0.19 < nearest <= 0.2  # ten bisections of nine decades leave 2 %
    assert _designed_gains(blind, 0.99 * nearest).shape == (2, 2, 1)


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
