"""Hybrid systems as python-control objects, against closed forms and against our own runtime."""

from __future__ import annotations

from typing import Any

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railway_runs import NO_ZONES, started
from steady_train import RADIUS, steady_train
from toy_systems import Clockwork, Hyperbola, Slider

from fmu_observer.observers.parameter_values import parameter_values
from plant_models import Locomotive, Odometer
from plant_models.hybrid import HybridSystem, PeriodicEvent, vector
from plant_models.hybrid.signal import input_signal, memory, output_signal, parameter, state
from plant_models.interop import OperatingPointError, left_out, operating_point, to_nonlinear_io, to_state_space
from plant_models.railway.adhesion import BURCKHARDT_NOMINAL

TRAIN = Locomotive()
MASS, INERTIA, WEIGHT = 90e3, 225.0, 90e3 * 9.81
DAVIS_B, DAVIS_C = 32.0, 1.7


class Chain(HybridSystem):
    """Two masses with a spring and a damper between them, and a force on the first."""

    name = "chain"
    states = (state("p", "m", (0.0, 0.0), size=2), state("v", "m/s", (1.0, 0.0), size=2))
    inputs = (input_signal("force", "N"),)
    outputs = (output_signal("stretch", "m"), output_signal("pull", "N"))
    parameters = (
        parameter("mass", "kg", (2.0, 3.0), size=2),
        parameter("stiffness", "N/m", 50.0),
        parameter("damping", "kg/s", 4.0),
    )

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        pull = self.output(t, x, u, p)["pull"]
        return {"p": x.v, "v": vector((u.force - pull) / p.mass[0], pull / p.mass[1])}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        stretch = x.p[0] - x.p[1]
        return {"stretch": stretch, "pull": p.stiffness * stretch + p.damping * (x.v[0] - x.v[1])}


class Counter(HybridSystem):
    """Nothing in it flows."""

    name = "counter"
    states = (memory("count", "1"),)
    parameters = (parameter("period", "s", 1.0),)
    events = (PeriodicEvent("tick", "period"),)

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"count": x.count + 1.0}


# -- linearisation --------------------------------------------------------------------------------------------------


def test_the_spring_chain_has_its_textbook_matrices() -> None:
    found = to_state_space(Chain(), parameters={"stiffness": 80.0})
    m1, m2, k, d = 2.0, 3.0, 80.0, 4.0
    A = [[0, 0, 1, 0], [0, 0, 0, 1], [-k / m1, k / m1, -d / m1, d / m1], [k / m2, -k / m2, d / m2, -d / m2]]
    np.testing.assert_allclose(found.A, A, rtol=1e-14, atol=0.0)
    np.testing.assert_array_equal(found.B, [[0], [0], [1 / m1], [0]])
    np.testing.assert_allclose(found.C, [[1, -1, 0, 0], [k, -k, d, -d]], rtol=1e-14)
    np.testing.assert_array_equal(found.D, np.zeros((2, 1)))
    assert found.state_labels == ["p[1]", "p[2]", "v[1]", "v[2]"]
    assert (found.input_labels, found.output_labels, found.name) == (["force"], ["stretch", "pull"], "chain")


@settings(max_examples=20)
@given(speed=st.floats(1.0, 50.0))
def test_the_locomotives_linearisation_is_the_closed_form(speed: float) -> None:
    states, inputs = steady_train(speed)
    drag = 900.0 + DAVIS_B * speed + DAVIS_C * speed**2
    assert inputs["effort"] == pytest.approx(drag, rel=1e-9)  # a steady train needs what resists it
    A = to_state_space(TRAIN, states, inputs).A
    slip = RADIUS * states["wheel_rate"] / speed - 1.0
    assert BURCKHARDT_NOMINAL.coefficient(slip) * WEIGHT == pytest.approx(drag, rel=1e-9)
    slope = WEIGHT * (0.4287 * 40.0 * np.exp(-40.0 * slip) - 0.3)  # of (3.12), Table 3.2
    by_v, by_w = -slope * (1.0 + slip) / speed, slope * RADIUS / speed
    expected = [
        [0.0, 1.0, 0.0],
        [0.0, (by_v - DAVIS_B - 2.0 * DAVIS_C * speed) / MASS, by_w / MASS],
        [0.0, -RADIUS * by_v / INERTIA, -RADIUS * by_w / INERTIA],
    ]
    np.testing.assert_allclose(A, expected, rtol=1e-9)


def test_the_slow_mode_of_the_train_is_its_drag_slope() -> None:
    A = to_state_space(TRAIN, *steady_train(13.9)).A
    slow = sorted(np.linalg.eigvals(A).real)[1]
    expected = -(DAVIS_B + 2.0 * DAVIS_C * 13.9) / (MASS + INERTIA / RADIUS**2)
    assert slow == pytest.approx(expected, rel=1e-5)  # the creep between train and wheel is left out of the closed form


def test_a_state_at_rest_that_friction_holds_stays_at_rest() -> None:
    at_rest = to_state_space(Slider(), {"v": 0.0}, {"push": 0.3})
    np.testing.assert_array_equal(at_rest.A, [[0.0, 1.0], [0.0, 0.0]])
    np.testing.assert_array_equal(at_rest.B, [[0.0], [0.0]])
    np.testing.assert_array_equal(to_state_space(Slider(), {"v": 1.0}).B, [[0.0], [1.0]])


# -- simulation -----------------------------------------------------------------------------------------------------

TIGHT = {"rtol": 1e-10, "atol": 1e-12}


def test_the_response_of_python_control_is_that_of_our_runtime() -> None:
    times = np.linspace(0.0, 5.0, 26)
    response = control.input_output_response(
        to_nonlinear_io(Chain()), times, np.full((1, 26), 7.0), [0.0, 0.0, 1.0, 0.0], solve_ivp_kwargs=TIGHT
    )
    runtime = started(Chain(), u0=[7.0])
    rows = []
    for t in times:
        runtime.advance(float(t))
        rows.append(runtime.update_outputs().copy())
    # the solver's 1e-10 over 5 s
    np.testing.assert_allclose(response.outputs, np.transpose(rows), rtol=1e-8, atol=1e-8)


def test_a_locomotive_in_python_control_runs_as_in_our_runtime() -> None:
    speed, effort = 12.0, 40e3
    start = [0.0, speed, speed / RADIUS]
    stiff = {"solve_ivp_method": "Radau", "solve_ivp_kwargs": {"rtol": 1e-8, "atol": 1e-10}}
    system = to_nonlinear_io(TRAIN, "chapter_3", NO_ZONES)
    response = control.input_output_response(system, [0.0, 2.0, 4.0], np.full((1, 3), effort), start, **stiff)
    runtime = started(TRAIN, "chapter_3", x0=start, u0=[effort], **NO_ZONES)
    runtime.advance(4.0)
    found = dict(zip(system.output_labels, response.outputs[:, -1], strict=True))
    # test_locomotive_accuracy: 1e-7 m, 1e-9 m/s, and Radau
    assert found["position"] == pytest.approx(runtime.x[0], abs=1e-5)
    assert found["speed"] == pytest.approx(runtime.x[1], abs=1e-5)


def test_time_and_held_memory_enter() -> None:
    response = control.input_output_response(
        to_nonlinear_io(Hyperbola()), [0.0, 1.0, 2.0], 0.0, [1.0], solve_ivp_kwargs=TIGHT
    )
    np.testing.assert_allclose(response.outputs[0], [1.0, 0.5, 0.2], rtol=1e-8)
    clock = to_nonlinear_io(Clockwork(), memory={"sample": 4.5})
    assert clock.output(0.0, [0.0, 0.0], [0.0])[clock.output_labels.index("last")] == 4.5


def test_parameters_can_be_changed_at_every_call() -> None:
    chain = to_nonlinear_io(Chain(), parameters={"stiffness": 10.0})
    assert chain.output(0.0, [1.0, 0.0, 0.0, 0.0], [0.0])[1] == 10.0
    assert chain.output(0.0, [1.0, 0.0, 0.0, 0.0], [0.0], {"stiffness": 30.0})[1] == 30.0
    assert chain.params == {"mass[1]": 2.0, "mass[2]": 3.0, "stiffness": 10.0, "damping": 4.0}


# -- what is left out, and what is refused --------------------------------------------------------------------------


def test_what_is_left_out_is_said_in_words() -> None:
    assert left_out(Chain()) == "Nothing is left out."
    text = left_out(Odometer())
    assert "periodic 'sampling'" in text
    assert "held_reading, counted_pulses, primed" in text
    assert "triggered 'kick'" in left_out(Clockwork())


def test_a_system_without_anything_continuous_is_refused() -> None:
    for convert in (to_nonlinear_io, to_state_space):
        with pytest.raises(ValueError, match=r"counter: nothing in it is continuous.*periodic 'tick'.*Runtime"):
            convert(Counter())
    with pytest.raises(
        ValueError, match=r"hyperbola: it has no inputs, and a StateSpace needs some; .*to_nonlinear_io"
    ):
        to_state_space(Hyperbola())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"x0": {"train_spede": 1.0}}, r"locomotive: state 'train_spede' is unknown; did you mean train_speed"),
        ({"x0": [1.0]}, r"locomotive: state: got 1 values, expected 3: train_position"),
        ({"u0": {"odometer": 1.0}}, r"input 'odometer' is unknown; known: effort"),
        ({"u0": [float("nan")]}, r"input 'effort' is nan; expected a finite number"),
        ({"parameters": {"davis": 1.0}}, r"parameter 'davis' is unknown; did you mean davis_"),
        ({"memory": {"sample": 1.0}}, r"memory 'sample' is unknown; known: none"),
        ({"preset": "chapter_9"}, r"unknown preset 'chapter_9'"),
    ],
)
def test_wrong_names_and_numbers_are_named(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        to_state_space(TRAIN, **arguments)


# -- operating points -----------------------------------------------------------------------------------------------


def test_the_operating_point_of_the_chain_under_a_wanted_pull() -> None:
    every = ("p[1]", "p[2]", "v[1]", "v[2]")
    point = operating_point(Chain(), [0.0, 0.0, 2.0, 2.0], hold=every[1:], drift=every, outputs={"pull": 25.0})
    assert point.states["p[1]"] == pytest.approx(0.5, rel=1e-12)
    assert point.derivatives["v[1]"] == pytest.approx(-12.5, rel=1e-12)


def test_as_many_unknowns_as_equations_are_asked_for() -> None:
    with pytest.raises(ValueError, match=r"chain: 4 unknowns .* but 5 equations"):
        operating_point(Chain(), outputs={"pull": 1.0})


def test_a_train_that_nothing_drives_has_no_equilibrium_at_speed() -> None:
    with pytest.raises(OperatingPointError, match=r"locomotive: no operating point .*d train_speed/dt is off by"):
        operating_point(
            TRAIN,
            {"train_speed": 10.0, "wheel_rate": 10.0 / RADIUS},
            parameters={"gradient[1]": 0.9},
            hold=("train_position", "train_speed"),
            drift=("train_position",),
            find=("effort",),
        )


@pytest.mark.parametrize("t", [5.0, 15.0])
def test_a_plant_with_switchings_is_linearised_on_the_side_where_it_is(t: float) -> None:
    """At 15 s the rail is degraded (a zone from 10 to 20 s): the slope of the adhesion is that of central differences
    there.
    """
    train, zones = Locomotive(), {"zone_from[1]": 10.0, "zone_to[1]": 20.0}
    x = np.array([0.0, 10.0, 10.05])
    A = to_state_space(train, x, parameters=zones, t=t).A
    p = parameter_values(train, zones)
    u = np.zeros(len(train.start_inputs()))
    rate = lambda state: np.ravel(np.asarray(train.state_derivative(t, state, u, p), dtype=float))  # noqa: E731
    step = 1e-6
    numeric = np.stack([(rate(x + step * e) - rate(x - step * e)) / (2.0 * step) for e in np.eye(3)], axis=1)
    assert A[:3, :3] == pytest.approx(numeric, rel=1e-5, abs=1e-6)
