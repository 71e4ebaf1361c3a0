"""The two integrators: observed order, stiffness, and dry friction, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from railway_runs import started
from toy_systems import Hyperbola, ImplicitHyperbola, ImplicitSlider, Slider, Stiff

from plant_models.hybrid import HybridSystem
from plant_models.hybrid.integration import step


def _error(system: HybridSystem, h: float) -> float:
    runtime = started(system, internal_step=h)
    runtime.advance(2.0)
    return abs(float(runtime.x[0]) - 1.0 / 5.0)


@pytest.mark.parametrize(("system", "order"), [(Hyperbola(), 4), (ImplicitHyperbola(), 2)])
def test_the_observed_order_is_the_stated_one(system: HybridSystem, order: int) -> None:
    steps = [0.1 / 2**i for i in range(5)]
    errors = [_error(system, h) for h in steps]
    observed = np.log2(np.array(errors[:-1]) / errors[1:])
    assert observed[-1] == pytest.approx(order, abs=0.15)  # the next order's term still shows at these steps
    assert errors[-1] < 1e-4


def test_the_implicit_step_follows_a_stiff_equation_at_steps_ten_thousand_times_its_time_constant() -> None:
    runtime = started(Stiff())
    runtime.advance(3.0)
    # Order reduction on stiff problems leaves an error of h * |second derivative| at most; measured 3e-9.
    assert runtime.x[0] == pytest.approx(np.cos(3.0), abs=1e-4)


def test_the_implicit_step_forgets_a_wrong_start_at_once() -> None:
    runtime = started(Stiff(), x0=[5.0])
    runtime.advance(0.02)
    # L-stability: the first step removes all but h-small parts
    assert runtime.x[0] == pytest.approx(np.cos(0.02), abs=1e-3)


@pytest.mark.parametrize("system", [Slider(), ImplicitSlider()])
def test_a_sliding_block_stops_at_the_closed_form_time_and_stays(system: HybridSystem) -> None:
    runtime = started(system)
    times = np.round(np.arange(0.01, 4.0, 0.01), 12)
    speeds = []
    for t in times:
        runtime.advance(float(t))
        speeds.append(float(runtime.x[1]))
    stop = times[np.flatnonzero(np.array(speeds) == 0.0)[0]]
    assert abs(stop - 2.0) <= 0.01 + 1e-12  # v0 / friction, to one internal step
    assert all(v == 0.0 for t, v in zip(times, speeds, strict=True) if t > stop)
    assert runtime.x[0] == pytest.approx(1.0, abs=0.5 * 0.5 * 0.01**2 + 1e-12)  # v0^2 / (2 friction), to the last step


@pytest.mark.parametrize("system", [Slider(), ImplicitSlider()])
@given(push=st.floats(-2.0, 2.0))
def test_a_block_at_rest_moves_only_if_the_push_exceeds_the_friction(system: HybridSystem, push: float) -> None:
    runtime = started(system, x0=[0.0, 0.0])
    runtime.u[0] = push
    runtime.advance(1.0)
    excess = np.sign(push) * max(abs(push) - 0.5, 0.0)
    # The first step holds or lets go as a whole: the speed is right to one step's worth of friction.
    assert runtime.x[1] == pytest.approx(excess, abs=0.5 * 0.01 + 1e-12)
    assert (runtime.x[1] == 0.0) == (abs(push) <= 0.5)


def test_friction_never_drives_whatever_the_sign() -> None:
    for v0 in (1.0, -1.0):
        runtime = started(Slider(), x0=[0.0, v0])
        runtime.u[0] = -0.3 * v0
        runtime.advance(5.0)
        assert runtime.x[1] == 0.0


def test_an_unknown_method_and_a_missing_jacobian_are_named() -> None:
    system = Hyperbola()
    system.method = "heun"  # type: ignore[assignment]
    arguments = (system, 0.0, 0.1, system.start_state(), system.start_inputs(), system.start_parameters())
    with pytest.raises(ValueError, match=r"hyperbola: unknown method 'heun'"):
        step(*arguments)
    implicit = ImplicitHyperbola()
    with pytest.raises(ValueError, match="needs the Jacobian"):
        step(implicit, 0.0, 0.1, implicit.start_state(), implicit.start_inputs(), implicit.start_parameters())


def test_explicit_euler_is_one_evaluation_a_step() -> None:
    """``dx = -2 t x^2`` at t = 1/2 by hand: 1, then 1 - h, then (1 - h) - h (1 - h)^2."""
    system = Hyperbola()
    system.method = "euler"
    x = np.array([1.0])
    for expected in (0.9, 0.9 - 0.1 * 0.81):
        x = step(system, 0.5, 0.1, x, system.start_inputs(), system.start_parameters())
        np.testing.assert_allclose(x, [expected], rtol=1e-15)
