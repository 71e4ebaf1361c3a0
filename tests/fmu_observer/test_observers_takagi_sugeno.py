"""The Takagi-Sugeno observer: premises, presets, gains."""

import numpy as np
import pytest
from observer_runner import SteadyMotion, in_step, random_gaps, started

from fmu_observer.observers.parameter_values import parameter_values
from fmu_observer.observers.train import TakagiSugenoCdo


def test_a_frozen_premise_keeps_the_odometer_of_the_last_balise() -> None:
    motion = SteadyMotion(speed=14.0, acceleration=1.0)
    runner = started(TakagiSugenoCdo(), motion)
    runner.follow(motion, [0.4], feed=0.01)
    at_balise = (50.0 - motion.v(0.4)) / 45.0
    assert runner.state("vertex_weight") == pytest.approx(at_balise, abs=1e-12)
    runner.set("u", {"odometer": 30.0})
    runner.runtime.advance(0.8)
    assert runner.state("vertex_weight") == pytest.approx(at_balise, abs=1e-12)


@pytest.mark.parametrize(("premise", "expected"), [("live", (50.0 - 30.0) / 45.0), ("estimated", (50.0 - 20.0) / 45.0)])
def test_live_and_estimated_premises_follow_their_source(premise: str, expected: float) -> None:
    observer = TakagiSugenoCdo(premise=premise)  # type: ignore[arg-type]
    x, u, p = (
        observer.unpack_states(observer.start_state())._replace(estimated_speed=20.0),
        observer.unpack_inputs(np.array([0.0, 30.0, 0.0, 0.0])),
        observer.start_parameters(),
    )
    assert observer.vertex_weight(x, u, observer.unpack_parameters(p)) == pytest.approx(expected, abs=1e-15)
    assert "vertex_weight" not in [s.name for s in observer.states]


@pytest.mark.parametrize(("odometer", "weight"), [(0.0, 1.0), (5.0, 1.0), (27.5, 0.5), (50.0, 0.0), (70.0, 0.0)])
def test_weights_stay_within_the_vertices(odometer: float, weight: float) -> None:
    runner = started(TakagiSugenoCdo(), SteadyMotion(speed=odometer))
    runner.balise(0.0)
    assert runner.state("vertex_weight") == pytest.approx(weight, abs=1e-15)


def test_inside_the_vertices_the_blend_is_the_true_drag() -> None:
    motion = SteadyMotion(speed=33.0)
    runner = in_step(TakagiSugenoCdo(), motion)
    runner.runtime.start(0.0)
    runner.balise(0.0)
    runner.runtime.advance(5.0)
    assert runner.outputs()["speed"] == pytest.approx(33.0, abs=1e-10)  # equilibrium to rounding, no balise needed


def test_the_published_decay_diverges_at_its_own_design_gap_and_the_repaired_one_does_not() -> None:
    motion = SteadyMotion(speed=20.0)
    errors = {}
    for preset in ("as_published", "repaired"):
        runner = started(TakagiSugenoCdo(), motion, preset=preset)
        runner.follow(motion, np.full(20, 0.5))
        errors[preset] = abs(runner.outputs()["speed"] - 20.0)
    assert errors["as_published"] > 1e3  # 19 m/s growing 2.7 times a balise, until drag and friction interfere
    assert errors["repaired"] < 1e-3


def test_the_published_decay_works_at_short_gaps() -> None:
    motion = SteadyMotion(speed=20.0)
    runner = started(TakagiSugenoCdo(), motion, preset="as_published")
    runner.follow(motion, random_gaps(9, 0.25, 100))
    assert runner.outputs()["speed"] == pytest.approx(20.0, abs=1e-3)


def test_an_unknown_premise_is_refused() -> None:
    with pytest.raises(ValueError, match="unknown premise 'thawed'"):
        TakagiSugenoCdo(premise="thawed")  # type: ignore[arg-type]


def test_vertices_at_one_speed_are_one_linear_model() -> None:
    """At that speed the weight was 0/0."""
    observer = TakagiSugenoCdo(premise="live")
    values = parameter_values(observer, {"premise_min": 50.0})
    u = observer.start_inputs()
    u[1] = 50.0  # odometer
    x = observer.start_state()
    assert np.isfinite(observer.state_derivative(0.0, x, u, values)).all()
    assert observer.input_signals[1].name == "odometer"
