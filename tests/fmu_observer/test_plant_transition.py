"""How filters move with a plant: its own steps whatever the period, and what is said where they are not accurate."""

from __future__ import annotations

from math import exp
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from own_condition import own_condition
from scipy.integrate import solve_ivp
from shipped import shipped

import cosim
from fmu_observer.models.filter_models import FilterModel, Known
from fmu_observer.models.known_models import MODELS
from fmu_observer.models.moving_system import UNROLLED, Steps
from fmu_observer.models.traced_system_model import find_filter_model, system_model
from fmu_observer.observers.generic.discrete.ensemble_kalman_filter import EnsembleKalmanFilter
from fmu_observer.observers.generic.discrete.extended_kalman_filter import ExtendedKalmanFilter, KalmanFilter
from fmu_observer.observers.generic.discrete.unscented_kalman_filter import UnscentedKalmanFilter
from plant_models import PLANTS
from plant_models.hybrid import HybridSystem, Runtime, input_signal, output_signal, scalar_names, state

MOTOR: dict[str, Any] = {"outputs": ["current_d", "current_q"]}


class Fast(HybridSystem):
    """A linear plant that forgets within 20 ms."""

    name = "fast"
    internal_step = 1e-3
    states = (state("x", "1", 1.0, "State"),)
    inputs = (input_signal("u", "1"),)
    outputs = (output_signal("y", "1", "State"),)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"x": -50.0 * x.x + u.u}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"y": x.x}


def known_of(model: FilterModel, u: np.ndarray | None = None) -> Known:
    starts = np.array([float(s.start_values[0]) for s in model.inputs])
    return Known(0.0, starts if u is None else u, np.array([v for s in model.parameters for v in s.start_values]))


def moved(model: FilterModel, x: np.ndarray, period: float, u: np.ndarray | None = None) -> np.ndarray:
    return np.asarray(model.moved(x, model.no_noise(), known_of(model, u), period))


def serving() -> list[str]:
    """Plants that can be the model of a filter, by the one output that is named first."""
    found = []
    for name in PLANTS:
        system = shipped(name)
        names = scalar_names(system.outputs)
        try:
            model = system_model(system, names[:1]) if names and system.traceable else None
        except ValueError:
            continue
        if model is not None and model.any_period:
            found.append(name)
    return found


@pytest.mark.parametrize("name", serving())
@pytest.mark.parametrize("count", [3, 40])
def test_a_filter_moves_as_its_plant_does(name: str, count: int) -> None:
    """Over periods of few and of many internal steps: the very run of the plant, with its inputs held."""
    system = PLANTS[name]()
    # where events divide the steps of the plant, those of the filter are the same only if they end there too
    period = (count - (0.0 if system.periodic_events else 0.5)) * system.internal_step
    model = system_model(system, scalar_names(system.outputs)[:1], steps=Steps(period))
    runtime = Runtime(PLANTS[name]())
    runtime.p[scalar_names(runtime.system.parameter_signals).index("internal_step")] = period / count
    x = runtime.x[: system.continuous_count].copy()
    runtime.start(0.0)
    runtime.advance(period)
    expected = runtime.x[: system.continuous_count]
    # the same operations but for the time of a step, which is a product there and a sum here
    np.testing.assert_allclose(moved(model, x, period), expected, rtol=1e-9, atol=1e-9 * np.abs([1, *expected]).max())


@settings(max_examples=20, deadline=None)
@given(period=st.floats(1e-4, 0.5), start=st.floats(-10.0, 10.0), drive=st.floats(-5.0, 5.0))
def test_a_linear_plant_is_that_of_its_solution(period: float, start: float, drive: float) -> None:
    model = system_model(Fast(), ["y"], steps=Steps(period))
    exact = exp(-50.0 * period) * start + (1.0 - exp(-50.0 * period)) * drive / 50.0
    # Runge-Kutta of order 4: (50 h)^5 / 120 a step, at most 0.5 / h steps of h = 1 ms
    np.testing.assert_allclose(moved(model, np.array([start]), period, np.array([drive])), exact, atol=3e-6)


def test_a_fast_plant_at_a_slow_period() -> None:
    """Four steps gave 0.177 where 4.5e-5 is true, and the condition held."""
    accurate = KalmanFilter(Fast(), outputs=["y"], period=0.2)
    assert accurate.model.sample_period == 0.2
    assert moved(accurate.model, np.ones(1), 0.2) == pytest.approx(exp(-10.0), rel=1e-6)
    evaluated = own_condition(accurate)
    assert evaluated.holds
    assert evaluated.numbers["transition_error"] < 1e-9
    assert not evaluated.remarks
    coarse = own_condition(KalmanFilter(Fast(), outputs=["y"], substeps=4), {"sample_period": 0.2})
    assert not coarse.holds
    assert coarse.numbers["transition_error"] == pytest.approx(0.1767, rel=1e-3)
    assert "not accurate" in coarse.remarks[0]


def test_a_motor_at_50_ms_is_that_of_another_solver() -> None:
    filters = ExtendedKalmanFilter("synchronous_motor", **MOTOR, period=0.05)
    system, x, u = PLANTS["synchronous_motor"](), np.array([0.1, 2.0, 50.0, 0.3]), np.array([10.0, 100.0, 0.0])
    p = system.start_parameters()
    ours = moved(filters.model, x, 0.05, u)
    theirs = solve_ivp(
        lambda t, y: system.state_derivative(t, y, u, p), (0.0, 0.05), x, "LSODA", rtol=1e-12, atol=1e-12
    )
    np.testing.assert_allclose(ours, theirs.y[:, -1], rtol=1e-7)  # 500 steps of order 4
    assert own_condition(filters).numbers["transition_error"] < 1e-8
    assert (
        own_condition(ExtendedKalmanFilter("synchronous_motor", **MOTOR, substeps=4), {"sample_period": 0.05})
        .remarks[0]
        .startswith("its transition over a period is not accurate")
    )


@pytest.mark.parametrize("kind", [KalmanFilter, UnscentedKalmanFilter, EnsembleKalmanFilter])
def test_a_longer_period_than_the_steps_are_for_is_refused(kind: Any) -> None:
    runtime = Runtime(kind(Fast(), outputs=["y"]))
    place = scalar_names(runtime.system.parameter_signals).index("sample_period")
    runtime.p[place] = 0.2
    with pytest.raises(ValueError, match=r"sample_period must be at most 0\.004.* option period"):
        runtime.start(0.0)
    runtime.p[place] = 0.003
    runtime.start(0.0)
    free = Runtime(kind(Fast(), outputs=["y"], substeps=4))
    free.p[place] = 0.2
    free.start(0.0)


@pytest.mark.parametrize(
    ("fed_to", "said"),
    [({"period": 0.0}, "a time above 0"), ({"period": "long"}, "a time above 0"), ({"period": 1e4}, "100000 at most")],
)
def test_bad_periods_are_refused_in_words(fed_to: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        KalmanFilter(Fast(), outputs=["y"], **fed_to)


def test_many_steps_are_a_loop_with_equal_numbers_and_slopes() -> None:
    rolled, written = (
        system_model(PLANTS["pendulum"](), ["angle"], steps=Steps(substeps=n)) for n in (UNROLLED + 4, 6)
    )
    finer = system_model(PLANTS["pendulum"](), ["angle"], steps=Steps(substeps=UNROLLED))
    x, period = np.array([1.0, -0.5]), 0.06
    # order 4: the differences of 6, 8 and 12 steps fall as their fourth powers
    apart = [np.abs(moved(m, x, period) - moved(rolled, x, period)).max() for m in (written, finer)]
    assert apart[0] < 1e-8
    assert apart[1] < apart[0]
    F, G = (np.asarray(m.transition_jacobians(x, known_of(m), period)[0]) for m in (rolled, written))
    np.testing.assert_allclose(F, G, atol=1e-7)
    assert KalmanFilter(Fast(), outputs=["y"], period=1.0).model.linear
    with pytest.raises(ValueError, match="nonlinear"):
        KalmanFilter("pendulum", outputs=["angle"], period=1.0)


@pytest.mark.parametrize("name", MODELS)
def test_observer_models_move_accurately_at_their_own_period(name: str) -> None:
    model = find_filter_model(name)
    assert model.transition_error(model.start, known_of(model), model.sample_period) < 1e-4


@pytest.mark.compiler
@pytest.mark.parametrize("period", [0.1, 0.2])  # one after the other in one process
def test_the_period_in_a_scenario_is_the_one_that_a_filter_is_built_for(period: float) -> None:
    """No option is needed: readings every 0.1 or 0.2 s of a pendulum whose internal step is 5 ms."""
    scenario = cosim.Scenario(stop=2.0, step=0.1, certificates="ignore")
    scenario.add("plant", model="pendulum", **{"as": "block3"})
    scenario.add(
        "filter",
        observer="extended_kalman_filter",
        options={"model": "pendulum", "outputs": ["angle"]},
        parameters={"sample_period": period},
        **{"as": "fmu3"},
    )
    scenario.connect("plant.angle -> filter.measured_angle").set("plant.torque", 2.0).set("filter.torque", 2.0)
    outcome = scenario.run(warn=lambda _: None)
    assert outcome.failure is None
    # no noise, and both begin where they are: nothing but rounding is left to correct
    own = slice(None, None, round(period / 0.1))
    np.testing.assert_allclose(outcome["filter.pendulum_angle"][own], outcome["plant.angle"][own], atol=1e-9)


# -- deviations of exactly zero ---------------------------------------------------------------------------------------


def first_sample(kind: Any, form: str, variance: float) -> dict[str, float]:
    system = kind(form=form)
    runtime, states = Runtime(system), scalar_names(system.states)
    runtime.p[scalar_names(system.parameter_signals).index("measurement_covariance[1]")] = 1e-10
    rooted = form == "square_root"
    stem, start = ("estimate_covariance_factor", variance**0.5) if rooted else ("estimate_covariance", variance)
    for i in (1, 4):
        runtime.x[states.index(f"{stem}[{i}]")] = start
    runtime.start(0.0)
    return dict(zip(scalar_names(system.outputs), runtime.update_outputs().tolist(), strict=True))


@pytest.mark.parametrize(("kind", "form"), [(k, f) for k in (KalmanFilter, UnscentedKalmanFilter) for f in k.forms])
@pytest.mark.parametrize("variance", [1.0, 1e10, 1e100])
def test_a_deviation_of_exactly_zero_is_flagged(kind: Any, form: str, variance: float) -> None:
    """After a reading of noise R a deviation is near sqrt(R): where rounding leaves nothing, that is told."""
    y = first_sample(kind, form, variance)
    angle = next(value for name, value in y.items() if name.endswith("_std"))
    right = angle == pytest.approx(1e-5, rel=0.1)
    assert (y["covariance_not_positive"] == 0.0) == right


@pytest.mark.parametrize("form", KalmanFilter.forms)
def test_an_infinite_covariance_is_refused(form: str) -> None:
    with np.errstate(invalid="ignore"), pytest.raises(ValueError, match="estimate_covariance"):
        first_sample(KalmanFilter, form, float("inf"))
