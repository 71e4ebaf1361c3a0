"""The MDPE controller: poles as designed, bumpless changes, no windup, limits and rates kept, whatever comes in."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from control_runs import Controller
from hypothesis import given, settings
from hypothesis import strategies as st

from plant_models.railway.control import MdpeController

MDPE = MdpeController()
T, MASS = 0.1, 166e3
BANDWIDTHS = {1.0: (0.5, 0.5, 0.2, 0.32), 2.0: (0.25, 0.25, 0.1, 0.16)}
FREE = {"effort_rate": 1e9}
MODES: list[tuple[int, float, dict[str, float], dict[str, float]]] = [
    (1, 0.2, {"disturbance_force": 50e3}, {}),
    (2, -0.2, {"disturbance_force": -20e3}, {"full_brake_force": 0.0}),
    (3, -0.2, {"disturbance_force": -50e3, "acceleration_reference": -0.3}, {}),
    (4, -0.6, {"disturbance_force": -50e3}, {"full_brake_force": 1e3}),
]


def driven(mode: int, level: float, error: float, inputs: dict[str, float], changes: dict[str, float]) -> np.ndarray:
    """Tracking errors of a mass whose force is the controller's target, period by period."""
    names = {"odometer": 10.0, "speed": 10.0, "speed_reference": 10.0 + error, "adhesion_condition": level, **inputs}
    # Under degraded adhesion the available effort must not be what limits here; an electric brake is left where there
    # is no air.
    controller = Controller(MDPE, start={**names, "adhesion_force": 350e3}, **FREE, **changes)
    speed, reference, errors = 10.0, 10.0 + error, []
    rise = inputs.get("acceleration_reference", 0.0)
    for k in range(80):
        out = controller.at(k * T, speed=speed, speed_reference=reference)
        assert out["mode"] == mode
        assert out["adhesion_level"] == level
        errors.append(reference - speed)
        speed += T / MASS * (controller.memory("target_force") - inputs["disturbance_force"])
        reference += T * rise
    return np.array(errors)


@pytest.mark.parametrize(
    ("mode", "error", "inputs", "changes"), MODES, ids=["traction", "electric", "indirect", "combined"]
)
@pytest.mark.parametrize("level", [1.0, 2.0])
def test_the_error_dies_with_the_designed_double_pole(
    mode: int, level: float, error: float, inputs: dict[str, float], changes: dict[str, float]
) -> None:
    rho = np.exp(-BANDWIDTHS[level][mode - 1] * T)
    # From e and a zero integral under (z - rho)^2: e_k = rho^k (e + c k) with e_1 = (2 rho - 1) e.
    k = np.arange(80)
    expected = rho**k * (error + error * (rho - 1.0) / rho * k)
    # The first control instant switches mode or level and takes over a zero force there: its integral is not the free
    # one.
    measured = driven(mode, level, error, inputs, changes)
    first = int(mode != 1 or level != 1.0)
    if first:
        expected = free_response(rho, measured[1], measured[2], k[1:] - 1)
    np.testing.assert_allclose(measured[first:], expected, atol=1e-9)


def free_response(rho: float, e0: float, e1: float, k: np.ndarray) -> np.ndarray:
    return rho**k * (e0 + (e1 / rho - e0) * k)


@settings(max_examples=8)
@given(load=st.floats(20e3, 120e3))
def test_an_unknown_constant_load_leaves_no_error(load: float) -> None:
    controller = Controller(MDPE, start={"odometer": 10.0, "speed": 10.0, "speed_reference": 10.0})
    speed = 10.0
    for k in range(800):
        out = controller.at(k * T, speed=speed, odometer=speed)
        speed += T / MASS * (out["effort"] - load)
    assert speed == pytest.approx(10.0, abs=1e-6)
    assert out["effort"] == pytest.approx(load, rel=1e-5)


def test_a_known_slope_is_fed_forward_without_waiting_for_an_error() -> None:
    controller = Controller(
        MDPE, start={"odometer": 10.0, "speed": 10.0, "speed_reference": 10.0, "slope": 0.008}, **FREE
    )
    assert controller.at(0.0)["effort"] == pytest.approx(166e3 * 9.81 * 0.008)
    assert controller.at(5.0, disturbance_force=5e3)["effort"] == pytest.approx(166e3 * 9.81 * 0.008 + 5e3)


@given(
    error=st.floats(-3.0, 3.0),
    load=st.floats(0.0, 100e3),
    level=st.sampled_from([1.0, 2.0]),
    periods=st.integers(1, 40),
)
def test_a_change_of_adhesion_level_moves_no_force(error: float, load: float, level: float, periods: int) -> None:
    reported = {"odometer": 10.0, "speed": 10.0, "speed_reference": 10.0 + error, "disturbance_force": load}
    controller = Controller(
        MDPE, start={**reported, "adhesion_force": 400e3, "adhesion_condition": level}, recovery_time=0.0
    )
    controller.at(periods * T)
    mode, before = controller.memory("held_mode"), controller.memory("target_force")
    controller.at((periods + 1) * T, adhesion_condition=3.0 - level)
    assert controller.memory("held_level") == 3.0 - level
    if controller.memory("held_mode") == mode:
        assert controller.memory("target_force") == pytest.approx(before, abs=1e-6)


def test_a_change_of_mode_starts_from_the_force_of_the_old_one() -> None:
    reported = {"odometer": 10.0, "speed": 10.2, "speed_reference": 10.0, "disturbance_force": -30e3}
    controller = Controller(MDPE, start=reported)
    controller.at(3.0)
    assert controller.memory("held_mode") == 2.0
    before = controller.memory("target_force")
    controller.at(3.1, coupler_force=-160e3)  # pressed: air takes over
    assert controller.memory("held_mode") == 3.0
    assert controller.memory("target_force") == pytest.approx(before, abs=1e-6)
    # A step of the reference's acceleration at the change is not lost.
    controller.at(3.2, acceleration_reference=-0.1)
    assert controller.memory("target_force") == pytest.approx(before - 0.1 * MASS - integral_step(0.2, 0.2), abs=1.0)


def integral_step(bandwidth: float, error: float) -> float:
    return float((1.0 - np.exp(-bandwidth * T)) ** 2 * MASS / T * error)


def test_a_minute_in_the_limit_winds_nothing_up() -> None:
    controller = Controller(MDPE, start={"odometer": 10.0, "speed": 10.0, "speed_reference": 15.0}, **FREE)
    out = controller.at(60.0)
    assert out["effort"] == 350e3
    # At rest in the limit: Ki T e + (1 - rho) (limit - F) = 0, so F stands above the limit by (1 - rho) M e / T.
    reach = 1.0 - np.exp(-0.5 * T)
    proportional = 2.0 * reach * MASS / T * 5.0
    assert controller.memory("integral") == pytest.approx(350e3 + reach * MASS / T * 5.0 - proportional, rel=1e-6)
    assert controller.at(60.1, speed_reference=9.95)["mode"] == 1.0
    out = controller.at(60.5, speed_reference=9.8)
    assert out["effort"] <= 0.0  # half a second after the error turned round


@pytest.mark.parametrize(("mode", "error", "inputs", "changes"), MODES[:2], ids=["traction", "electric"])
def test_the_rate_of_effort_limits_no_regulator_while_the_coupler_is_unloaded(
    mode: int, error: float, inputs: dict[str, float], changes: dict[str, float]
) -> None:
    targets = []
    for rate in (1e3, 1e9):
        names = {"odometer": 10.0, "speed": 10.0, "speed_reference": 10.0 + error, **inputs}
        controller = Controller(MDPE, start=names, **changes, effort_rate=rate)
        assert controller.at(0.0)["mode"] == mode
        targets.append(controller.memory("target_force"))
    assert targets[0] == targets[1]
    assert abs(targets[0]) > 1e3 * T


SAMPLE = st.fixed_dictionaries(
    {
        "odometer": st.floats(0.0, 50.0),
        "speed": st.floats(0.0, 50.0),
        "adhesion_force": st.floats(-350e3, 350e3),
        "slip": st.floats(-0.3, 0.3),
        "adhesion_condition": st.sampled_from([1.0, 2.0]),
        "coupler_force": st.floats(-400e3, 400e3),
        "disturbance_force": st.floats(-100e3, 100e3),
        "slope": st.floats(-0.03, 0.03),
        "speed_reference": st.one_of(st.just(0.0), st.floats(0.0, 50.0)),
        "acceleration_reference": st.floats(-1.0, 1.0),
    }
)


@given(samples=st.lists(SAMPLE, min_size=2, max_size=12), preset=st.sampled_from(sorted(MDPE.presets)))
def test_limits_and_rates_hold_whatever_comes_in(samples: list[dict[str, float]], preset: str) -> None:
    controller = Controller(MDPE, preset, start=samples[0])
    p = MDPE.unpack_parameters(MDPE.start_parameters(preset))
    previous = 0.0
    for k, reported in enumerate(samples):
        out = controller.at(k * T, **reported)
        fading = 1.0 if preset == "single_mass" else np.clip((reported["odometer"] - 0.5) / 1.5, 0.0, 1.0)
        available = out["effort_available"]
        lowest = -min(p.electric_brake_limit * fading, available)
        highest = min(350e3, 4.2e6 / max(reported["odometer"], 1e-9), available)
        assert lowest - 1e-6 <= out["effort"] <= highest + 1e-6
        nearest = np.clip(previous, lowest, highest)  # what the limits alone would have made of it
        assert abs(out["effort"] - nearest) <= 68e3 * T + 1e-6
        assert 0.0 <= out["brake_demand"] <= (1.0 if preset == "train" else 0.0)
        assert (
            out["effort"] <= 0.0 or out["mode"] == 1.0 or out["effort"] < previous
        )  # no traction under a brake, but on its way out
        previous = out["effort"]


@given(samples=st.lists(SAMPLE, min_size=2, max_size=10), other=st.floats(-400e3, 400e3))
def test_the_demanded_change_of_force_stays_within_what_the_coupler_allows(
    samples: list[dict[str, float]], other: float
) -> None:
    steady = {"odometer": 10.0, "slip": 0.0, "adhesion_condition": 1.0, "coupler_force": other}
    controller = Controller(MDPE, start={**samples[0], **steady})
    previous = 0.0
    for k, reported in enumerate(samples):
        effort = controller.at(k * T, **{**reported, **steady})["effort"]
        room = np.clip((250e3 - abs(other)) / 100e3, -1.0, 1.0) * 68e3 * T
        change = effort - previous if other >= 0.0 else previous - effort  # what loads the coupler further
        back = np.clip(-previous if other >= 0.0 else previous, 0.0, 68e3 * T)  # a step towards zero is always allowed
        assert change <= max(room, back) + 1e-6
        assert abs(effort - previous) <= 68e3 * T + 1e-6
        previous = effort


def test_the_available_effort_follows_slip_and_recovers_at_its_rates() -> None:
    reported = {
        "odometer": 10.0,
        "speed": 9.0,
        "speed_reference": 15.0,
        "slip": 0.1,
        "adhesion_force": 60e3,
        "adhesion_condition": 2.0,
    }
    controller = Controller(MDPE, start=reported)
    controller.set(held_effort=100e3)
    assert controller.at(T)["effort"] <= 51e3 + 1e-6
    assert controller.at(T)["effort_available"] == pytest.approx(51e3)
    assert controller.at(2.1, slip=0.03)["effort_available"] == pytest.approx(51e3 + 20 * 500.0)
    assert controller.at(2.1)["effort"] == pytest.approx(61e3)  # the error asks for more all the time
    assert controller.at(7.1, adhesion_condition=1.0)["adhesion_level"] == 1.0
    assert controller.at(7.1)["effort_available"] == pytest.approx(61e3 + 49 * 500.0 + 5e3)
    assert controller.at(8.1)["effort_available"] == pytest.approx(61e3 + 49 * 500.0 + 11 * 5e3)


@pytest.mark.parametrize("slip", [0.05, -0.05, 0.1, -0.1])
@pytest.mark.parametrize("error", [1.5, -1.5, 2.5, -2.5])
def test_sand_is_requested_where_slip_and_error_are_beyond_their_limits(slip: float, error: float) -> None:
    controller = Controller(
        MDPE, start={"odometer": 10.0, "speed": 10.0, "speed_reference": 10.0 + error, "slip": slip}
    )
    assert bool(controller.at(0.0)["sanding_request"]) is (abs(slip) > 0.072 and abs(error) > 2.0)


@pytest.mark.parametrize(
    ("preset", "effort", "demand", "mode"), [("train", 0.0, 60e3 / 164e3, 3.0), ("single_mass", -60e3, 0.0, 2.0)]
)
def test_a_standing_train_is_held_until_the_reference_rises(
    preset: str, effort: float, demand: float, mode: float
) -> None:
    controller = Controller(MDPE, preset)
    out = controller.at(10.0)
    assert (out["effort"], out["brake_demand"], out["mode"]) == (pytest.approx(effort), pytest.approx(demand), mode)
    controller.set(integral=-5e4)  # what a stop leaves
    controller.at(10.1)
    assert controller.memory("integral") == 0.0
    out = controller.at(13.0, acceleration_reference=0.35)
    assert (out["brake_demand"], out["mode"]) == (0.0, 1.0)
    assert out["effort"] > 0.0


def test_a_locked_wheel_is_no_standing_train() -> None:
    controller = Controller(MDPE, start={"odometer": 0.0, "speed": 5.0, "speed_reference": 0.0})
    assert controller.at(1.0)["brake_demand"] > 60e3 / 164e3 + 0.1
    out: dict[str, Any] = controller.at(10.0, speed=0.0)
    assert out["brake_demand"] == pytest.approx(60e3 / 164e3)


def test_near_standstill_a_slip_ratio_says_nothing() -> None:
    reported = {"speed_reference": 5.0, "slip": -1.0, "adhesion_force": 5e3}
    assert Controller(MDPE, start={**reported, "speed": 0.9, "odometer": 0.4}).at(0.0)["effort_available"] == 350e3
    assert Controller(MDPE, start={**reported, "speed": 1.1, "odometer": 0.0}).at(0.0)["effort_available"] == 10e3


def test_error_and_power_are_those_of_now() -> None:
    controller = Controller(MDPE, start={"odometer": 10.0, "speed": 9.0, "speed_reference": 10.0})
    effort = controller.at(0.0)["effort"]
    out = controller.at(0.05, odometer=12.0, speed=9.5)
    assert (out["speed_error"], out["drive_power"]) == (pytest.approx(0.5), pytest.approx(effort * 12.0))
    assert effort == pytest.approx(6.8e3)


@given(samples=st.lists(SAMPLE, min_size=2, max_size=5))
def test_members_of_a_batch_are_controlled_like_one_alone(samples: list[dict[str, float]]) -> None:
    names = [s.name for s in MDPE.inputs]
    u = np.array([[reported[name] for reported in samples] for name in names])
    p = MDPE.start_parameters()
    x = np.repeat(MDPE.start_state()[:, None], len(samples), axis=1)
    together = MDPE.jump_vector("control", 0.0, x, u, p)
    for k in range(len(samples)):
        np.testing.assert_array_equal(together[:, k], MDPE.jump_vector("control", 0.0, x[:, k], u[:, k], p))


def test_a_locked_wheel_has_no_electric_brake_so_air_is_asked_for() -> None:
    reported = {"speed": 5.0, "speed_reference": 4.8}
    assert Controller(MDPE, start={**reported, "odometer": 5.0}).at(0.0)["mode"] == 2.0
    assert Controller(MDPE, start={**reported, "odometer": 0.0}).at(0.0)["mode"] == 3.0
