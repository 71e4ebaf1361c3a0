"""The excessive-slip indicator: confirmed, held, and by how much."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from observer_runner import SystemRunner

from fmu_observer.detection import ExcessiveSlip

SPEED = 10.0
BENCH = SystemRunner(ExcessiveSlip())


def odometer(slip: float) -> float:
    """Odometer speed [m/s] that has this slip (3.49) at `SPEED`."""
    return SPEED / (1.0 - slip)


def drive(slips: list[tuple[float, float]], **parameters: float) -> list[dict[str, float]]:
    """Outputs every 0.05 s under slips held for durations, the filter as fast as it may be."""
    runner = BENCH  # tracing it costs more than the run
    runner.runtime.reset()
    runner.set("p", {"slip_filter_time": 0.01, **parameters})
    rows, k = [], 0
    for slip, duration in slips:
        for _ in range(round(duration / 0.05)):
            runner.set("u", {"odometer": odometer(slip), "speed": SPEED})
            if k == 0:
                runner.runtime.start(0.0)
            k += 1
            runner.runtime.advance(k * 0.05)
            rows.append(runner.outputs())
    return rows


def test_the_story_of_the_soapy_run() -> None:
    """Sc2: 40 % and, later, 25 % of slip exceed the 15 % by 25 and 10 points; the indicator stays on in between."""
    rows = drive([(0.05, 1.0), (0.40, 2.0), (0.05, 2.5), (0.25, 2.0), (0.05, 5.0)])
    levels = np.array([r["slip_indicator"] for r in rows])
    exceedance = np.array([r["exceedance"] for r in rows])
    # five time constants of the filter are left within a check period: exp(-5) of the change
    assert exceedance[20:60].max() == pytest.approx(0.25, abs=1e-3)
    assert exceedance[110:150].max() == pytest.approx(0.10, abs=1e-3)
    assert rows[100]["peak_exceedance"] == pytest.approx(0.25, abs=1e-3)
    on = np.flatnonzero(levels == 2.0)
    assert np.array_equal(on, np.arange(on[0], on[-1] + 1)), "one episode"
    time = 0.05 * (on + 1)
    assert time[0] == pytest.approx(1.0 + 0.2, abs=0.051)  # confirmed, to a check period
    assert time[-1] == pytest.approx(7.5 + 3.0, abs=0.051)  # held, to a check period
    assert rows[-1]["peak_exceedance"] == 0.0


def test_a_short_excess_is_not_confirmed_and_leaves_no_trace() -> None:
    rows = drive([(0.4, 0.2), (0.0, 2.0)])
    assert {r["slip_indicator"] for r in rows} == {1.0}
    assert rows[-1]["peak_exceedance"] == 0.0


def test_braking_slip_and_wheel_lock_count_too() -> None:
    assert drive([(-0.4, 1.0)])[-1]["slip_indicator"] == 2.0
    runner = SystemRunner(ExcessiveSlip())
    runner.set("u", {"odometer": 0.0, "speed": SPEED})
    runner.runtime.start(0.0)
    runner.runtime.advance(1.0)
    assert runner.outputs()["slip_indicator"] == 2.0


def test_standstill_is_not_evaluated() -> None:
    runner = SystemRunner(ExcessiveSlip())
    runner.set("u", {"odometer": 0.4, "speed": 0.0})
    runner.runtime.start(0.0)
    runner.runtime.advance(2.0)
    assert runner.outputs()["slip_indicator"] == 1.0
    assert runner.outputs()["exceedance"] == 0.0


@settings(max_examples=60, deadline=None)
@given(
    pattern=st.lists(st.booleans(), min_size=5, max_size=60),
    confirm=st.integers(0, 4),
    hold=st.integers(0, 8),
)
@example(pattern=[True, False, False, False], confirm=0, hold=2)
@example(pattern=[True, True, False, True, False, False], confirm=1, hold=1)
def test_the_indicator_is_that_of_the_definition(pattern: list[bool], confirm: int, hold: int) -> None:
    """Against the definition by runs of the pattern, not by a state machine."""
    rows = drive([(0.5 if over else 0.0, 0.05) for over in pattern], confirm_time=confirm * 0.05, hold_time=hold * 0.05)
    # A slip of 50 % set at check k - 1 is beyond 15 % at check k; back at 0 it is below: ln(0.5/0.15) < 5 time
    # constants.
    expected, triggers = [], []
    for k, over in enumerate(pattern):
        run = all(pattern[max(k - confirm, 0) : k + 1]) and k >= confirm
        still_on = bool(triggers) and k <= triggers[-1] + hold + 1  # on until this check
        if over and (run or still_on):
            triggers.append(k)
        expected.append(2.0 if triggers and k <= triggers[-1] + hold else 1.0)
    assert [r["slip_indicator"] for r in rows] == expected


def test_the_presets_carry_the_published_thresholds() -> None:
    assert ExcessiveSlip().preset_values("experiment")["slip_threshold"] == 0.15
    assert ExcessiveSlip().preset_values("simulation")["slip_threshold"] == 0.02
