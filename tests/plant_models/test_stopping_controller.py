"""The stopping controller on its own: plans, tracking, limits, standstill, and what it does in a fault."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from plant_models.hybrid import Runtime, scalar_names
from plant_models.railway.control.stopping_controller import StoppingController
from plant_models.railway.control.stopping_planner import plan_stop

SYSTEM = StoppingController()
PERIOD = 0.01


class Controlled:
    """The controller at the instants of its period, and a train that is moved by hand."""

    def __init__(self, preset: str | None = None, **parameters: float) -> None:
        self.runtime = Runtime(SYSTEM)
        self.runtime.p[:] = SYSTEM.start_parameters(preset)
        self.set("p", {"control_period": PERIOD, "effort_limit": 1000.0} | parameters)

    def set(self, group: str, values: dict[str, float]) -> None:
        names = scalar_names(SYSTEM.input_signals if group == "u" else SYSTEM.parameter_signals)
        for name, value in values.items():
            getattr(self.runtime, group)[names.index(name)] = value

    def start(self, **inputs: float) -> Any:
        self.set("u", inputs)
        self.runtime.start(0.0)
        return self.reported()

    def step(self, **inputs: float) -> Any:
        self.set("u", inputs)
        self.runtime.advance(self.runtime.t + PERIOD)
        return self.reported()

    def reported(self) -> Any:
        values = self.runtime.update_outputs()
        return SimpleNamespace(**dict(zip(scalar_names(SYSTEM.outputs), map(float, values), strict=True)))

    def follow(self, steps: int) -> Any:
        """A train that is exactly where the reference is."""
        reported = self.reported()
        for _ in range(steps):
            self.runtime.advance(self.runtime.t + PERIOD)
            reported = self.reported()
            self.set(
                "u", {"estimated_position": reported.position_reference, "estimated_speed": reported.speed_reference}
            )
        return reported


def test_the_plan_is_that_of_the_planner() -> None:
    c = Controlled(final_speed=2.0, mass=3.0, davis_b=0.6)
    reported = c.start(estimated_position=20.0, estimated_speed=25.0)
    plan = plan_stop(25.0, 80.0, drag_rate=0.2, brake_coefficient=0.1, mass=3.0, final_speed=2.0)
    assert reported.planned_effort == reported.effort == pytest.approx(plan.effort, rel=1e-12)
    reported = c.follow(200)
    assert reported.speed_reference == pytest.approx(plan.speed(2.0), rel=1e-12)
    assert reported.position_reference == pytest.approx(20.0 + plan.position(2.0), rel=1e-12)
    assert (reported.plans, reported.no_braking_solution, reported.limited_plan, reported.brake_released) == (
        1.0,
        0.0,
        0.0,
        0.0,
    )


def test_the_law_of_the_tracking() -> None:
    """``u = u* - (L1 e + L2 p_i + d) m / b`` with the minus sign; the integral sums the errors of the instants."""
    c = Controlled()
    first = c.start(estimated_position=0.0, estimated_speed=30.0)
    before = c.step(estimated_position=0.3, estimated_speed=30.0)
    error = 30.0 - before.speed_reference
    after = c.step(estimated_position=0.6, estimated_speed=30.0, disturbance=-0.7)
    later = 30.0 - after.speed_reference
    integral = PERIOD * (error + later)
    assert after.effort == pytest.approx(first.planned_effort - 10.0 * (1.4 * later + 0.5 * integral - 0.7), rel=1e-12)


def test_the_classical_one_knows_neither_disturbance_nor_fault() -> None:
    with_, without = Controlled("classical"), Controlled("classical")
    for c, d in ((with_, -0.7), (without, 0.0)):
        c.start(estimated_position=0.0, estimated_speed=30.0, disturbance=d)
    reported = [c.step(estimated_position=0.3, odometer_fault=f) for c, f in ((with_, 1.0), (without, 0.0))]
    assert reported[0] == reported[1]
    assert with_.step(odometer_fault=0.0).plans == 1.0


def test_the_printed_sign_drives_away_from_the_reference() -> None:
    c = Controlled("as_published")
    c.start(estimated_position=0.0, estimated_speed=30.0)
    assert c.step(estimated_position=0.31, estimated_speed=31.0).effort > c.reported().planned_effort


def test_a_fault_releases_the_brake_and_its_end_makes_a_new_plan() -> None:
    c = Controlled()
    c.start(estimated_position=0.0, estimated_speed=30.0)
    c.follow(50)
    reported = c.step(odometer_fault=1.0)
    assert (reported.brake_released, reported.plans) == (1.0, 1.0)
    assert reported.effort < 0.0  # the brake goes on being commanded
    at = {"estimated_position": 30.0, "estimated_speed": 29.0}
    reported = c.step(odometer_fault=0.0, **at)
    assert (reported.brake_released, reported.plans) == (0.0, 2.0)
    assert reported.planned_effort == reported.effort  # the integral restarts: the train is on the new reference
    assert reported.planned_effort == pytest.approx(plan_stop(29.0, 70.0, drag_rate=0.1, brake_coefficient=0.1).effort)


def test_a_request_renews_the_plan_once() -> None:
    c = Controlled()
    c.start(estimated_position=0.0, estimated_speed=30.0, plan_request=4.0)
    assert c.step(estimated_position=0.3).plans == 1.0
    reported = c.step(estimated_position=1.6, plan_request=5.0)  # a balise moved the estimate by a metre
    assert reported.plans == 2.0
    assert reported.position_reference == pytest.approx(1.6)
    assert c.step(estimated_position=1.9).plans == 2.0
    assert c.step(odometer_fault=1.0, plan_request=6.0).plans == 2.0  # a fault is no time for plans
    assert c.step(odometer_fault=0.0).plans == 3.0


def test_no_braking_solution_rolls() -> None:
    reported = Controlled().start(estimated_position=0.0, estimated_speed=5.0)
    assert (reported.no_braking_solution, reported.limited_plan, reported.planned_effort, reported.effort) == (
        1.0,
        0.0,
        0.0,
        0.0,
    )


@pytest.mark.parametrize("position", [99.0, 100.0, 130.0])
def test_a_mark_too_near_or_behind_brakes_with_all_there_is(position: float) -> None:
    c = Controlled(effort_limit=200.0)
    reported = c.start(estimated_position=position, estimated_speed=30.0)
    assert (reported.limited_plan, reported.no_braking_solution, reported.effort) == (1.0, 0.0, -200.0)
    assert c.follow(200).speed_reference == pytest.approx(0.0, abs=1e-12)


def test_limits_are_kept_and_what_they_cut_is_not_integrated() -> None:
    c = Controlled(effort_limit=30.0)
    c.start(estimated_position=0.0, estimated_speed=30.0)
    for k in range(100):
        reported = c.step(estimated_position=0.3 * (k + 1), estimated_speed=30.0)  # the brake does not act
        assert -30.0 <= reported.effort <= 0.0
    integral = c.runtime.x[scalar_names(SYSTEM.states).index("integral")]
    assert integral < 0.1  # 0.13 m would be the sum of a second


def test_a_train_at_standstill_is_held_until_it_is_let_go() -> None:
    c = Controlled()
    assert c.start(estimated_position=40.0, estimated_speed=0.0).effort == -10.0
    assert c.step(estimated_speed=0.05).effort == -10.0  # creeps: held still
    reported = c.step(estimated_speed=0.2, odometer_fault=1.0)
    assert reported.plans == 1.0  # it runs: planned for
    assert c.step(enabled=0.0).effort == 0.0
    assert c.step(estimated_speed=0.0, enabled=1.0, odometer_fault=1.0).brake_released == 0.0  # nothing to release


@pytest.mark.parametrize(("speed", "reported"), [(0.0, 0.0), (-0.09, 0.0), (-0.11, 1.0), (-0.5, 1.0)])
def test_a_train_that_rolls_back_is_reported(speed: float, reported: float) -> None:
    """Ten times the speed of standstill: what is faster does not stand, in either direction."""
    controlled = Controlled()
    controlled.start(estimated_speed=0.0, estimated_position=100.0)
    assert controlled.step(estimated_speed=speed, estimated_position=99.0).rolls_back == reported


def test_a_train_that_is_let_go_is_planned_for_anew() -> None:
    c = Controlled()
    c.start(estimated_position=0.0, estimated_speed=30.0, enabled=0.0)
    reported = c.reported()
    assert (reported.effort, reported.plans, reported.speed_reference) == (0.0, 0.0, 30.0)
    assert c.step(estimated_position=0.3, enabled=1.0).plans == 1.0
    assert c.step(enabled=0.0).effort == 0.0
    assert c.step(enabled=1.0).plans == 2.0


def test_batches_are_their_members() -> None:
    """One jump of three trains at once: each as alone."""
    x = np.repeat(SYSTEM.start_state()[:, None], 3, axis=1)
    u = np.repeat(SYSTEM.start_inputs()[:, None], 3, axis=1)
    p = SYSTEM.start_parameters()
    u[:2] = [[0.0, 99.9, 20.0], [30.0, 30.0, 2.0]]
    together = SYSTEM.jump_vector("control", 0.5, x, u, np.repeat(p[:, None], 3, axis=1))
    for k in range(3):
        assert np.array_equal(together[:, k], SYSTEM.jump_vector("control", 0.5, x[:, k], u[:, k], p))


@pytest.mark.parametrize(("short", "reported"), [(0.81, 1.0), (0.2, 0.0), (-0.5, 0.0)])
def test_a_stop_short_of_the_mark_is_reported(short: float, reported: float) -> None:
    """Nothing pulls with a traction limit of zero; within the tolerance, or beyond the mark, it is no such stop."""
    c = Controlled(stop_position=100.0)
    c.start(estimated_position=50.0, estimated_speed=10.0)
    found = c.step(estimated_position=100.0 - short, estimated_speed=0.0)
    assert (found.stands_short, found.effort) == (reported, -10.0)


def test_a_train_that_passes_short_of_the_mark_does_not_stand_there() -> None:
    c = Controlled(stop_position=100.0)
    assert c.start(estimated_position=50.0, estimated_speed=10.0).stands_short == 0.0
