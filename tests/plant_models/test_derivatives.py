"""Derivatives with dry friction resolved, their indicators, exact directional derivatives, and communication events."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from railway_runs import started
from toy_systems import Clockwork, Slider

from plant_models import Driver, Locomotive, Odometer
from plant_models.hybrid import CommunicationEvent, HybridSystem, Runtime, TracedSystem, input_signal, memory, vector
from plant_models.hybrid.kernel import NumpyKernel

SYSTEMS = [Clockwork(), Slider(), Locomotive(), Locomotive(adhesion="polach"), Odometer(), Driver()]


@pytest.mark.parametrize(
    ("speed", "push", "expected"),
    [(1.0, 0.2, 0.2 - 0.5), (-1.0, 0.2, 0.2 + 0.5), (0.0, 0.4, 0.0), (0.0, 0.9, 0.9 - 0.5), (0.0, -0.9, -0.9 + 0.5)],
)
def test_dry_friction_opposes_motion_and_holds_at_rest(speed: float, push: float, expected: float) -> None:
    runtime = Runtime(Slider())
    runtime.x[:], runtime.u[0] = (0.0, speed), push
    assert runtime.derivatives().tolist() == pytest.approx([speed, expected], abs=1e-15)  # one rounding


@pytest.mark.parametrize(
    ("speed", "push", "expected"), [(1.5, 0.2, 1.5), (-1.5, 9.0, 1.5), (0.0, 0.4, 0.1), (0.0, -0.9, -0.4)]
)
def test_the_indicator_is_the_way_to_the_next_change(speed: float, push: float, expected: float) -> None:
    runtime = Runtime(Slider())
    runtime.x[:], runtime.u[0] = (0.0, speed), push
    assert runtime.indicators().tolist() == pytest.approx([expected], abs=1e-15)  # one rounding
    assert Runtime(Clockwork()).indicators().size == 0


def _point(system: HybridSystem, seed: int) -> tuple[float, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """A time, state, input and parameters at which the system moves, with what a solver holds there."""
    rng = np.random.default_rng(seed)
    x = system.start_state() + rng.uniform(0.5, 3.0, system.state_count)
    scale = 2e4 if isinstance(system, Locomotive) else 2.0
    u = system.start_inputs() + scale * rng.uniform(0.2, 1.0, len(system.start_inputs()))
    p = system.start_parameters()
    return 0.7, x, u, p, system.held_vector(0.7, x, u, p)


@pytest.mark.parametrize("system", SYSTEMS, ids=lambda s: f"{s.name}-{sorted(s.options.items())}")
@given(seed=st.integers(0, 10_000))
def test_the_traced_derivative_is_that_of_the_runtime(system: HybridSystem, seed: int) -> None:
    t, x, u, p, held = _point(system, seed)
    runtime = Runtime(system, NumpyKernel(system))
    runtime.t, runtime.x[:], runtime.u[:], runtime.p[:] = t, x, u, p
    traced = np.asarray(TracedSystem(system).derivative(t, x, u, p, held)).ravel()[: system.continuous_count]
    np.testing.assert_allclose(traced, runtime.derivatives(), rtol=1e-12, atol=1e-12)  # the same operations, reordered


@pytest.mark.parametrize("system", SYSTEMS, ids=lambda s: f"{s.name}-{sorted(s.options.items())}")
def test_the_tangent_agrees_with_central_differences(system: HybridSystem) -> None:
    t, x, u, p, held = _point(system, 5)
    traced = TracedSystem(system)
    rng = np.random.default_rng(6)
    direction = [1.0, rng.normal(size=x.size), rng.normal(size=u.size), 1e-3 * p * rng.normal(size=p.size)]
    exact = np.asarray(traced.tangent(t, x, u, p, held, *direction)).ravel()

    def unknowns(step: float) -> np.ndarray:
        point = [a + step * d for a, d in zip((t, x, u, p), direction, strict=True)]
        derivative = np.asarray(traced.derivative(*point, held)).ravel()[: system.continuous_count]
        return np.concatenate([np.asarray(traced.output(*point)).ravel()[: exact.size - derivative.size], derivative])

    h = 1e-5  # truncation h^2 ~ 1e-10, rounding 1e-16 / h ~ 1e-11 of the values
    difference = (unknowns(h) - unknowns(-h)) / (2.0 * h)
    scale = np.abs(unknowns(0.0)) + np.abs(exact) + 1.0
    assert np.max(np.abs(exact - difference) / scale) < 1e-7


def test_dependencies_of_the_derivative_include_the_friction() -> None:
    class Slowed(Slider):
        def friction(self, t: Any, x: Any, u: Any, p: Any) -> Any:
            return vector(p.friction_level * (1.0 + x.x**2))

    assert TracedSystem(Slider()).dependencies("derivative", "x").tolist() == [[False, True], [False, False]]
    assert TracedSystem(Slowed()).dependencies("derivative", "x").tolist() == [[False, True], [True, False]]
    assert TracedSystem(Slowed()).dependencies("flow", "x").tolist() == [[False, True], [False, False]]


class Listener(HybridSystem):
    """Remembers what it was told at the end of each communication step, and when."""

    name = "listener"
    states = (memory("heard", "1"), memory("heard_at", "s", -1.0), memory("times", "1"))
    inputs = (input_signal("word", "1"),)
    events = (CommunicationEvent("hearing"),)

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"heard": u.word, "heard_at": t, "times": x.times + 1.0}


def test_communication_events_happen_at_the_start_and_when_notified() -> None:
    runtime = Runtime(Listener())
    runtime.u[0] = 3.0
    runtime.start(2.0)
    assert runtime.x.tolist() == [3.0, 2.0, 1.0]
    runtime.u[0] = 4.0
    runtime.advance(2.5)
    assert runtime.x.tolist() == [3.0, 2.0, 1.0]
    runtime.communicate()
    assert runtime.x.tolist() == [4.0, 2.5, 2.0]


def test_the_next_instant_is_inside_the_step_or_none() -> None:
    runtime = started(Clockwork())  # instants 0.013 + k 0.07
    assert runtime.next_instant_before(0.1) == pytest.approx(0.013, abs=1e-15)  # one rounding
    assert runtime.next_instant_before(0.013) is None
    runtime.advance(0.013)
    assert runtime.next_instant_before(0.05) is None
    assert runtime.next_instant_before(0.09) == pytest.approx(0.083, abs=1e-15)  # one rounding
    assert Runtime(Slider()).next_instant_before(1.0) is None
