"""Dry friction in model exchange against closed forms: sticking, breaking away, stopping, standing at exactly zero."""

from __future__ import annotations

from collections.abc import Callable
from math import asin, cos, pi, sin
from typing import Any

import numpy as np
import pytest
from exchange_importer import Exchange, Importer, Notified
from fmpy import simulate_fmu
from scipy.optimize import brentq

from fmus import cached_fmu
from plant_models.hybrid import HybridSystem, TriggeredEvent, input_signal, output_signal, parameter, state, vector

pytestmark = pytest.mark.compiler

MASS, GRIP = 2.0, 3.0
TOLERANCE = 1e-11
AGREEMENT = 1e-9
"""Of values that the solver integrated with `TOLERANCE` over some tens of steps, and of instants where one crosses
zero.
"""


class SlidingMass(HybridSystem):
    """A mass on dry friction under a force that is a sine of time plus an input; a blow gives it another speed at
    once.
    """

    name = "sliding_mass"
    states = (state("place", "m"), state("speed", "m/s"))
    inputs = (input_signal("force", "N"),)
    outputs = (output_signal("speed_out", "m/s"), output_signal("place_out", "m"))
    parameters = (
        parameter("mass", "kg", MASS),
        parameter("grip", "N", GRIP),
        parameter("amplitude", "N", 0.0),
        parameter("pulsation", "rad/s", 2.0),
    )
    events = (TriggeredEvent("blow", (input_signal("blow_speed", "m/s", variability="discrete"),)),)
    frictions = ("speed",)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"place": x.speed, "speed": (u.force + p.amplitude * np.sin(p.pulsation * t)) / p.mass}

    def friction(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return vector(p.grip / p.mass)

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"speed": u.blow_speed}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"speed_out": x.speed, "place_out": x.place}


class SwitchedMass(HybridSystem):
    """A mass at rest on dry friction. By a switch a force of twice the friction begins, which then fades at a rate of
    one friction a second.
    """

    name = "switched_mass"
    states = (state("speed", "m/s"),)
    parameters = (parameter("begin", "s", 0.5),)
    frictions = ("speed",)
    switchings = ("begin",)

    def switching(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return vector(t - p.begin + 0.0 * x.speed)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"speed": GRIP / MASS * (2.0 - (t - p.begin)) * self.switches(t, x, u, p)[0]}

    def friction(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return vector(GRIP / MASS)


SYSTEM = SlidingMass()


def _importer(model: Exchange, inputs: Callable[[float], dict[str, float]] | None = None, **starts: float) -> Importer:
    return Importer(model, model.initialize(**starts), rtol=TOLERANCE, atol=TOLERANCE, inputs=inputs)


def test_ramp_sticks_then_breaks_away(version: int, exchange: Callable[..., Exchange]) -> None:
    rate = 1.3  # N/s
    model = exchange(SYSTEM, version)
    importer = _importer(model, lambda t: {"force": rate * t})
    for k in range(1, 41):
        importer.advance(0.1 * k)
        importer.record("speed", "place")
    breakaway = GRIP / rate
    # the indicator is linear in time: only rounding
    assert importer.run.state_events == pytest.approx([breakaway], rel=1e-14)
    times = np.array(importer.run.times)
    since = np.maximum(times - breakaway, 0.0)
    expected = np.stack([rate * since**2 / (2.0 * MASS), rate * since**3 / (6.0 * MASS)], axis=1)
    got = importer.run.values()
    np.testing.assert_allclose(got, expected, rtol=0.0, atol=AGREEMENT)
    assert np.all(got[times < breakaway] == 0.0)  # exactly


def test_a_force_that_a_switch_turns_on_breaks_away_at_once(version: int, exchange: Callable[..., Exchange]) -> None:
    """Whether the mass breaks away is decided with the force after the switch: it then moves, and does not stop where
    the force has faded to what the friction could hold.
    """
    model = exchange(SwitchedMass(), version)
    importer = _importer(model)
    importer.advance(2.0)
    assert importer.run.state_events == pytest.approx([0.5], abs=AGREEMENT)
    assert model.get("speed")[0] == pytest.approx(GRIP / MASS * (1.5 - 1.5**2 / 2.0), abs=AGREEMENT)


def _sine_cycle(amplitude: float, pulsation: float) -> tuple[float, float, Callable[[float], float]]:
    """Break-away and stop of the first half period, and the speed between them."""
    breakaway = asin(GRIP / amplitude) / pulsation

    def speed(t: float) -> float:
        pushed = amplitude * (cos(pulsation * breakaway) - cos(pulsation * t)) / (MASS * pulsation)
        return pushed - GRIP / MASS * (t - breakaway)

    peak = (pi - asin(GRIP / amplitude)) / pulsation  # where force and friction balance again
    return breakaway, brentq(speed, peak, peak + 1.5 / pulsation, xtol=1e-15), speed


def test_sine_sticks_breaks_away_and_stops_again_and_again(version: int, exchange: Callable[..., Exchange]) -> None:
    amplitude, pulsation = 4.0, 2.0
    breakaway, stop, speed = _sine_cycle(amplitude, pulsation)
    assert amplitude * abs(sin(pulsation * stop)) < GRIP  # so it stays where it stops
    model, half = exchange(SYSTEM, version), pi / pulsation
    importer = _importer(model, amplitude=amplitude, pulsation=pulsation)
    for k in range(1, 101):
        importer.advance(0.05 * k)
        importer.record("speed")
    expected_events = [t + k * half for k in range(3) for t in (breakaway, stop)]
    assert importer.run.state_events == pytest.approx(expected_events, rel=0.0, abs=AGREEMENT)
    for t, (got,) in zip(importer.run.times, importer.run.rows, strict=True):
        k, phase = divmod(t, half)
        moves = breakaway < phase < stop
        expected = (-1.0) ** k * speed(phase) if moves else 0.0
        assert got == (0.0 if not moves else pytest.approx(expected, abs=AGREEMENT))


def test_strong_sine_turns_round_without_a_rest(version: int, exchange: Callable[..., Exchange]) -> None:
    model = exchange(SYSTEM, version)
    importer = _importer(model, amplitude=60.0, pulsation=2.0)
    signs = []
    for k in range(1, 61):
        importer.advance(0.1 * k)
        signs.append(np.sign(model.get("speed")[0]))
    assert len(importer.run.state_events) >= 3
    assert 0.0 not in signs
    # each but the first break-away is one turn
    assert np.count_nonzero(np.diff(signs)) == len(importer.run.state_events) - 1
    assert np.diff(importer.run.state_events).min() > 0.1


def test_steps_of_the_force_stop_and_hold_it(version: int, exchange: Callable[..., Exchange]) -> None:
    model = exchange(SYSTEM, version)
    importer = _importer(model, speed=4.0)
    importer.advance(5.0)
    stop = 4.0 * MASS / GRIP
    assert importer.run.state_events == pytest.approx([stop], abs=AGREEMENT)
    assert model.get("speed", "place").tolist() == [0.0, pytest.approx(4.0 * stop / 2.0, abs=AGREEMENT)]
    importer.happen(force=GRIP)  # just held: at equality the set-valued law holds
    importer.advance(6.0)
    assert model.get("speed")[0] == 0.0
    assert model.derivatives().tolist() == [0.0, 0.0]
    importer.happen(force=-GRIP - 1.0)
    importer.advance(8.0)
    assert model.get("speed")[0] == pytest.approx(-2.0 / MASS, abs=AGREEMENT)


def test_indicators_are_speed_while_it_moves_and_what_friction_is_left_at_rest(
    version: int, exchange: Callable[..., Exchange]
) -> None:
    moving, resting, standing = (exchange(SYSTEM, version) for _ in range(3))
    moving.initialize(speed=-4.0)
    assert moving.indicators().tolist() == [4.0]
    resting.initialize(force=1.0)
    assert resting.indicators().tolist() == [(GRIP - 1.0) / MASS]
    assert resting.get("event_indicator.speed").tolist() == [(GRIP - 1.0) / MASS]
    standing.initialize(force=GRIP)
    assert 0.0 < standing.indicators()[0] < 1e-50  # no importer may take equality for a change


def test_derivatives_stay_smooth_beyond_the_event(version: int, exchange: Callable[..., Exchange]) -> None:
    """A solver looks a little beyond zero before it finds the event: the direction of friction must not change on the
    way.
    """
    model = exchange(SYSTEM, version)
    model.initialize(speed=1.0)
    for speed in (1.0, 1e-9, 0.0, -1e-3):
        model.set_state(0.1, np.array([0.0, speed]))
        assert model.derivatives().tolist() == [speed, -GRIP / MASS]
    assert model.indicators()[0] < 0.0
    update = model.happen()
    assert update.states_changed
    assert model.states().tolist() == [0.0, 0.0]
    assert model.derivatives().tolist() == [0.0, 0.0]


def test_jump_may_turn_the_motion_round(version: int, exchange: Callable[..., Exchange]) -> None:
    model = exchange(SYSTEM, version)
    importer = _importer(model, speed=1.0)
    importer.advance(0.25)
    importer.happen([Notified(0.25, "blow", {"blow_speed": -2.0})])
    assert model.get("speed")[0] == -2.0  # not stopped on the way
    assert model.derivatives().tolist() == [-2.0, GRIP / MASS]
    importer.advance(4.0)
    assert importer.run.state_events == pytest.approx([0.25 + 2.0 * MASS / GRIP], abs=AGREEMENT)


def test_fmpy_finds_equal_events(version: int) -> None:
    amplitude, pulsation = 4.0, 2.0
    breakaway, stop, speed = _sine_cycle(amplitude, pulsation)
    result = simulate_fmu(
        str(cached_fmu(SYSTEM, version)),  # type: ignore[arg-type]
        fmi_type="ModelExchange",
        solver="CVode",
        relative_tolerance=1e-9,
        stop_time=1.5,
        output_interval=0.05,
        start_values={"amplitude": amplitude, "pulsation": pulsation},
        output=["speed_out"],
    )
    expected = [speed(t) if breakaway < t < stop else 0.0 for t in result["time"]]
    np.testing.assert_allclose(result["speed_out"], expected, rtol=0.0, atol=1e-6)  # CVode's errors add up to some 1e-7
    events = [t for t, after in zip(result["time"], result["time"][1:], strict=False) if t == after]
    assert events[0] == pytest.approx(breakaway, abs=1e-6)


# -- the locomotive
# ---------------------------------------------------------------------------------------------------------

LOCOMOTIVE = {"davis_b": 0.0, "davis_c": 0.0}
"""Without the resistances that depend on speed the train brakes evenly."""


def _locomotive(
    model: Exchange, inputs: Callable[[float], dict[str, float]] | None = None, **starts: float
) -> Importer:
    update = model.initialize(**LOCOMOTIVE, **starts)
    return Importer(model, update, method="Radau", rtol=1e-9, atol=1e-10, inputs=inputs)


def test_locomotive_brakes_to_a_stop_and_stands(version: int, exchange: Callable[..., Exchange]) -> None:
    model = exchange("locomotive", version)
    mass, axles, inertia, radius, davis_a = model.get("mass", "n_axles", "wheel_inertia", "wheel_radius", "davis_a")
    speed, brake = 5.0, 40e3
    importer = _locomotive(model, train_speed=speed, wheel_rate=speed / radius, effort=-brake)
    for k in range(1, 31):
        importer.advance(0.5 * k)
        importer.record("train_speed", "wheel_rate", "train_position", "acceleration")
    deceleration = (brake + davis_a) / (mass + axles * inertia / radius**2)  # of train and wheels, rolling
    stop = speed / deceleration
    got, times = importer.run.values(), np.array(importer.run.times)
    rolling = times < stop - 0.5
    # the wheels creep by less than 1 % under this brake, and their share of the inertia with them
    np.testing.assert_allclose(got[rolling, 0], speed - deceleration * times[rolling], atol=0.01 * speed)
    standing = times > stop + 0.5
    assert standing.sum() > 5
    assert np.all(got[standing][:, [0, 1, 3]] == 0.0)  # speed, wheels and acceleration, exactly
    assert got[-1, 2] == pytest.approx(speed**2 / (2.0 * deceleration), rel=0.01)
    assert len(set(got[standing, 2])) == 1


def test_locomotive_breaks_away_when_the_wheels_pull_more_than_the_resistance(
    version: int, exchange: Callable[..., Exchange]
) -> None:
    model, rate = exchange("locomotive", version), 200.0  # N/s
    davis_a = model.get("davis_a")[0]
    expected = davis_a / rate
    importer = _locomotive(model, lambda t: {"effort": rate * t})
    importer.advance(expected * 0.98)
    assert model.derivatives()[1] == 0.0
    assert abs(model.get("train_speed")[0]) < 1e-20  # held; Radau's own Jacobian by differences leaves some rounding
    importer.advance(expected * 1.02)
    breakaway = importer.run.state_events[-1]
    # the pull follows the effort with the lag of the wheels, some ms here; never before it
    assert expected <= breakaway < expected * 1.005
    assert model.get("train_speed")[0] > 0.0
