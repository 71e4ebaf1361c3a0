"""The ADRC controller: poles as designed, disturbances rejected, nothing wound up, limits kept."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from control_runs import Controller
from hypothesis import given, settings
from hypothesis import strategies as st
from railway_runs import parameters, sampled, started
from scipy import signal

from plant_models.hybrid import HybridSystem, input_signal, parameter, state, vector
from plant_models.railway.control import AdrcController

ADRC = AdrcController()
WC, WO, MASS = 0.5, 1.5, 166e3


class MassUnderAdrc(HybridSystem):
    """A mass, a constant disturbing acceleration and the controller, as one continuous system."""

    name = "mass_under_adrc"
    states = (*ADRC.states, state("speed", "m/s"))
    inputs = (input_signal("reference", "m/s"), input_signal("rise", "m/s2"), input_signal("disturbance", "m/s2"))
    parameters = (*ADRC.parameters, parameter("true_mass", "kg", MASS))
    presets = ADRC.presets
    default_preset = "train"
    internal_step = 1e-2

    def reported(self, x: Any, u: Any) -> Any:
        return ADRC.unpack_inputs(vector(x.speed, u.reference, u.rise))

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        reported = self.reported(x, u)
        effort = ADRC.output(t, x, reported, p)["effort"] - x.built_up_brake
        return {**ADRC.flow(t, x, reported, p), "speed": effort / p.true_mass + u.disturbance}


def test_a_step_is_followed_with_the_designed_pole() -> None:
    loop = started(MassUnderAdrc(), x0=[10.0, 0.0, 0.0, 10.0], u0=[10.5, 0.0, 0.0])
    times = np.linspace(0.5, 12.0, 24)
    speed = sampled(loop, times)[:, 3]
    np.testing.assert_allclose(speed, 10.5 - 0.5 * np.exp(-WC * times), atol=1e-8)  # RK4 at 10 ms of poles at 1.5 rad/s


@pytest.mark.parametrize("disturbance", [-0.008 * 9.81, -0.2])
def test_a_constant_gradient_leaves_no_error(disturbance: float) -> None:
    loop = started(MassUnderAdrc(), x0=[10.0, 0.0, 0.0, 10.0], u0=[10.0, 0.0, disturbance])
    times = np.linspace(0.0, 40.0, 81)
    states = sampled(loop, times)
    # From the disturbance to the speed, by hand: s (s + wc + 2 wo) / ((s + wc) (s + wo)^2), zero at s = 0.
    transfer = signal.TransferFunction(
        [1.0, WC + 2.0 * WO, 0.0], np.polymul([1.0, WC], np.polymul([1.0, WO], [1.0, WO]))
    )
    _, response = signal.step(transfer, T=times)
    np.testing.assert_allclose(states[:, 3] - 10.0, disturbance * response, atol=1e-7)
    assert abs(states[-1, 3] - 10.0) < 1e-6
    assert -MASS * states[-1, 1] == pytest.approx(-MASS * disturbance, rel=1e-6)


@settings(max_examples=10)
@given(mass=st.floats(90e3, 300e3), disturbance=st.floats(-0.2, 0.2))
def test_a_wrong_mass_costs_time_and_no_error(mass: float, disturbance: float) -> None:
    loop = started(MassUnderAdrc(), x0=[10.0, 0.0, 0.0, 10.0], u0=[10.2, 0.0, disturbance], true_mass=mass)
    loop.advance(80.0)
    assert loop.x[3] == pytest.approx(10.2, abs=1e-4)


def test_a_limit_is_no_disturbance_and_winds_nothing_up() -> None:
    loop = started(MassUnderAdrc(), u0=[25.0, 0.0, 0.0])
    times = np.arange(0.25, 40.0, 0.25)
    states = sampled(loop, times)
    speed = states[:, 3]
    assert speed[3] == pytest.approx(350e3 / MASS, rel=1e-9)  # one second in the effort limit
    assert np.abs(states[:, 1]).max() < 1e-9  # it knows what was cut off
    assert speed.max() <= 25.0
    assert speed[-1] == pytest.approx(25.0, abs=0.1)


def test_a_ramped_drive_keeps_its_rate_and_the_observer_knows_it() -> None:
    controller = AdrcController(drive="ramped")

    class MassUnderRampedDrive(MassUnderAdrc):
        name = "mass_under_ramped_drive"
        states = (*controller.states, state("speed", "m/s"))
        parameters = (*controller.parameters, parameter("true_mass", "kg", MASS))

        def flow(self, t: Any, x: Any, u: Any, p: Any) -> Any:
            rates = controller.flow(t, x, self.reported(x, u), p)
            return {**rates, "speed": (x.drive_effort - x.built_up_brake) / p.true_mass + u.disturbance}

    loop = started(MassUnderRampedDrive(), u0=[25.0, 0.0, 0.0])
    times = np.arange(0.5, 3.01, 0.5)
    states = sampled(loop, times)
    np.testing.assert_allclose(states[:, 3], 68e3 * times, rtol=1e-9)  # far below what is asked for: at its rate
    np.testing.assert_allclose(states[:, 4], 0.5 * 68e3 / MASS * times**2, rtol=1e-9)
    assert np.abs(states[:, 1]).max() < 1e-9  # no disturbance in that
    loop.advance(60.0)
    assert loop.x[4] == pytest.approx(25.0, abs=1e-3)
    with pytest.raises(ValueError, match=r"unknown drive 'slow'.*immediate, ramped"):
        AdrcController(drive="slow")  # type: ignore[arg-type]


@given(
    x=st.tuples(st.floats(-5.0, 60.0), st.floats(-5.0, 5.0), st.floats(0.0, 164e3)),
    u=st.tuples(st.floats(-5.0, 60.0), st.floats(0.0, 60.0), st.floats(-2.0, 2.0)),
    preset=st.sampled_from(sorted(ADRC.presets)),
)
def test_the_effort_stays_within_its_limits(x: Any, u: Any, preset: str) -> None:
    p = ADRC.unpack_parameters(parameters(ADRC, preset))
    out = ADRC.output(0.0, ADRC.unpack_states(np.array(x)), ADRC.unpack_inputs(np.array(u)), p)
    assert -p.electric_brake_limit <= out["effort"] <= min(350e3, 4.2e6 / max(abs(u[0]), 1e-9)) * (1.0 + 1e-12)
    assert 0.0 <= out["brake_demand"] <= (1.0 if preset == "train" else 0.0)


def test_air_takes_over_from_the_electric_brake_in_service_braking() -> None:
    controller = Controller(ADRC, start={"odometer": 10.0, "speed_reference": 10.0, "acceleration_reference": -0.4})
    controller.set(observed_speed=10.0)
    force = 0.4 * MASS
    first = controller.at(0.0)
    assert first["brake_demand"] == pytest.approx(force / 164e3)
    assert first["effort"] == pytest.approx(-force)
    controller.set(built_up_brake=0.75 * force)
    assert controller.at(0.0)["effort"] == pytest.approx(-0.25 * force)
    controller.set(built_up_brake=force)
    assert controller.at(0.0)["effort"] == pytest.approx(0.0, abs=1e-6)
    # not service braking: electric alone, and the air is released
    light = controller.at(0.0, acceleration_reference=-0.1)
    assert light["brake_demand"] == 0.0


def test_a_standing_train_is_held_and_let_go() -> None:
    for preset, effort, demand in (("train", 0.0, 60e3 / 164e3), ("single_mass", -60e3, 0.0)):
        controller = Controller(ADRC, preset)
        out = controller.at(20.0)
        assert (out["effort"], out["brake_demand"]) == (pytest.approx(effort), pytest.approx(demand))
        assert controller.memory("disturbance_acceleration") == 0.0  # the hold is none
        controller.set(disturbance_acceleration=-0.3)  # what the stop left
        controller.at(22.0)
        assert controller.memory("disturbance_acceleration") == pytest.approx(-0.3 * np.exp(-WO * 2.0), rel=1e-6)
        assert controller.at(22.0, acceleration_reference=0.35)["effort"] > 0.0
