"""The pulse odometer: whole pulses, jams as shares of a window, counts that telescope."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railway_runs import outputs, started

from plant_models import PLANTS
from plant_models.hybrid import Runtime
from plant_models.railway.sensors.pulses import reading_bound

FROM_SPEED = PLANTS["pulse_odometer"]()
FROM_DISTANCE = PLANTS["pulse_odometer"](count_from="wheel_distance")
PULSE = 2.0 * np.pi * 0.46 / 100.0


def _counting(distance: float = 0.0, speed: float = 0.0, **changes: float) -> Runtime:
    return started(FROM_DISTANCE, None, None, [speed, distance, 0.0, 0.0], **changes)


@given(speed=st.floats(-50.0, 50.0))
@settings(max_examples=25)
def test_a_steady_wheel_is_read_within_one_pulse_from_the_start_on(speed: float) -> None:
    runtime = started(FROM_SPEED, None, None, [speed, 0.0, 0.0])
    for k in range(30):
        runtime.advance(0.05 * k)
        found = outputs(runtime)
        for name, period in (("reading", 0.2), ("sampled_reading", 0.05)):
            count = found[name] * period / PULSE
            assert count == pytest.approx(round(count), abs=1e-9)
            assert abs(found[name] - speed) <= PULSE / period * (1.0 + 1e-9)


def test_readings_change_at_their_own_instants_only() -> None:
    runtime = _counting()
    seen = []
    for k in range(1, 41):
        runtime.advance(0.01 * k)
        runtime.u[1] = 0.01 * k * (10.0 + k)  # faster and faster
        seen.append((outputs(runtime)["reading"], outputs(runtime)["sampled_reading"]))
    changes = [[k + 1 for k in range(1, 40) if seen[k][i] != seen[k - 1][i]] for i in (0, 1)]
    assert changes == [[20, 40], [5, 10, 15, 20, 25, 30, 35, 40]]


@given(onset=st.floats(0.2, 0.3), length=st.floats(0.0, 0.1), speed=st.floats(1.0, 40.0))
@settings(max_examples=30)
def test_a_jam_in_a_window_takes_its_share_of_the_reading(onset: float, length: float, speed: float) -> None:
    runtime = _counting(speed=speed)
    for k in range(1, 9):
        t = 0.05 * k
        jammed = float(np.clip(t - onset, 0.0, length))
        runtime.u[1] = speed * (t - jammed)
        runtime.advance(t)
    # S09: v (1 - T_jam / Dt), within the one pulse that the window may hold more or less
    assert abs(outputs(runtime)["reading"] - speed * (1.0 - length / 0.2)) <= PULSE / 0.2 * (1.0 + 1e-9)


def test_no_error_adds_up_over_a_hundred_thousand_samples() -> None:
    runtime = started(FROM_SPEED, None, None, [13.37, 0.0, 0.0], sample_period=0.01, aggregation_period=0.1)
    total = 0.0
    for k in range(1, 10_001):
        runtime.advance(0.1 * k)
        total += runtime.x[1] * 0.1
    samples = 100_000
    # one pulse, and the rounding of 1e5 additions of a distance of 13 km
    assert abs(total - 13.37 * 0.01 * samples) <= PULSE + 1e-6
    assert outputs(runtime)["distance"] == pytest.approx(total, abs=1e-6)


@given(onset=st.floats(0.0, 1.0), length=st.floats(0.0, 0.5), kind=st.sampled_from([-1.0, 1.0]))
@settings(max_examples=10)
def test_readings_do_not_depend_on_the_communication_step(onset: float, length: float, kind: float) -> None:
    readings = []
    for step in (0.001, 0.01, 0.05):
        faults = {"fault_onset[1]": onset, "fault_length[1]": length, "fault_kind[1]": kind}
        wheel = started(PLANTS["wheel_fault"](), None, None, [17.3, 0.0, 1e9, 0.0], **faults)
        odometer = _counting(speed=17.3)
        row = []
        for k in range(1, round(2.0 / step) + 1):
            wheel.advance(k * step)
            odometer.u[1] = outputs(wheel)["wheel_distance"] + 1e-9  # a pulse that ends at a sample is counted
            odometer.advance(k * step)
            if k % round(0.05 / step) == 0:
                row.append((outputs(odometer)["reading"], outputs(odometer)["sampled_reading"]))
        readings.append(row)
    np.testing.assert_allclose(readings[1:], [readings[0]] * 2, rtol=1e-12)


def test_noise_is_on_the_readings_and_never_in_the_distance() -> None:
    runtime = started(FROM_SPEED, None, None, [10.0, 0.0, 0.0], noise_std=0.3, seed=5.0)
    values = []
    for k in range(1, 2001):
        runtime.advance(0.2 * k)
        values.append(outputs(runtime)["reading"])
    n = len(values)
    spread = np.hypot(0.3, PULSE / 0.2 / 2.0)  # a count is off by up to half a pulse beside it
    assert np.mean(values) == pytest.approx(10.0, abs=4.0 * spread / np.sqrt(n))
    assert 0.3 * (1.0 - 4.0 / np.sqrt(2.0 * n)) < np.std(values) < spread * (1.0 + 4.0 / np.sqrt(2.0 * n))
    assert 0.0 <= 4000.0 - outputs(runtime)["distance"] < PULSE + 1e-6


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"teeth": 0.0}, r"teeth must be a finite number, at least 1 \(teeth = 0"),
        ({"wheel_radius": -0.46}, r"wheel_radius must be a finite number, at least 0.001 m"),
        ({"aggregation_period": 0.12}, "aggregation_period must be a whole multiple of sample_period"),
        ({"aggregation_period": 0.01}, "aggregation_period must be a whole multiple of sample_period"),
    ],
)
def test_a_wheel_without_teeth_radius_or_whole_samples_is_refused(changes: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        started(FROM_SPEED, None, **changes)


def test_an_unknown_source_of_the_count_is_refused() -> None:
    with pytest.raises(ValueError, match=r"unknown count_from 'axle'; choose one of: wheel_speed, wheel_distance"):
        PLANTS["pulse_odometer"](count_from="axle")


@pytest.mark.parametrize("teeth", [0.0, 100.0, 1000.0])
@pytest.mark.parametrize("noise", [0.0, 0.02, 0.05])
def test_a_reading_is_within_its_bound_but_for_one_in_an_hour(teeth: float, noise: float) -> None:
    """Two million windows of steady wheels that begin anywhere in a pulse; four deviations leave 6.3e-5 of them."""
    rng, count, period, radius = np.random.default_rng(5), 2_000_000, 0.2, 0.46
    way, begin = rng.uniform(1.0, 40.0, count) * period, rng.uniform(0.0, 1.0, count)
    pulse = 2.0 * np.pi * radius / teeth if teeth else 1.0
    whole = (np.floor(begin + way / pulse) - np.floor(begin)) * pulse if teeth else way
    error = (whole - way) / period + noise * rng.standard_normal(count)
    bound = float(reading_bound(noise, teeth, radius, period))
    beyond = float((np.abs(error) > bound).mean())
    expected = 6.334e-5 if noise else 0.0
    assert beyond <= expected + 4.0 * np.sqrt(expected / count)
    if noise or teeth:  # and it is not far: a bound that is a third lower is left by a hundred an hour
        assert (np.abs(error) > 0.66 * bound).mean() > 100.0 / 18000.0
