"""The odometer: exact where it is ideal, quantised and noisy where it is told to be."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from railway_runs import outputs, started

from plant_models import Odometer
from plant_models.hybrid import Runtime
from plant_models.hybrid.noise import standard_normal

ODOMETER = Odometer()
SPEED = st.floats(-60.0, 60.0)


def _set(runtime: Runtime, speed: float) -> None:
    runtime.u[0] = speed


def _started_at(speed: float, **changes: float) -> Runtime:
    return started(ODOMETER, u0=[speed, 0.0], **changes)


@given(speeds=st.lists(SPEED, min_size=2, max_size=8))
def test_an_ideal_reading_is_exactly_the_wheel_speed_at_the_instant(speeds: list[float]) -> None:
    runtime = _started_at(speeds[0])
    assert outputs(runtime)["reading"] == speeds[0]  # right already at the start
    for k, speed in enumerate(speeds[1:], start=1):
        _set(runtime, speed)
        runtime.advance(k * 0.01)
        assert outputs(runtime)["reading"] == speed


def test_a_reading_is_held_between_instants() -> None:
    runtime = _started_at(1.0, sample_period=0.1, sample_offset=0.03)
    assert outputs(runtime)["reading"] == 0.0  # not read yet
    seen = []
    for k in range(1, 30):
        _set(runtime, 1.0 + k)
        runtime.advance(k * 0.01)
        seen.append(outputs(runtime)["reading"])
    assert seen == [0.0] * 2 + [4.0] * 10 + [14.0] * 10 + [24.0] * 7


@given(speed=SPEED)
def test_the_distance_of_a_wheel_without_teeth_is_its_integral(speed: float) -> None:
    runtime = _started_at(speed)
    runtime.advance(3.0)
    assert outputs(runtime)["distance"] == pytest.approx(3.0 * speed, rel=1e-12, abs=1e-12)


@given(speed=SPEED, teeth=st.integers(1, 400), period=st.sampled_from([0.01, 0.05, 0.1]))
def test_a_toothed_wheel_reads_whole_pulses_next_to_the_speed(speed: float, teeth: int, period: float) -> None:
    runtime = _started_at(speed, teeth=float(teeth), sample_period=period)
    pulse = 2.0 * np.pi * 0.575 / teeth
    readings = [outputs(runtime)["reading"]]
    for k in range(1, 8):
        runtime.advance(k * period)
        readings.append(outputs(runtime)["reading"])
    counts = np.array(readings) * period / pulse
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)
    # A window of steady speed holds at most one pulse more or less than its share.
    assert np.abs(np.array(readings) - speed).max() <= pulse / period * (1.0 + 1e-9)
    distance = outputs(runtime)["distance"]
    assert -1e-9 <= 7 * period * speed - distance < pulse + 1e-9
    # No pulse is lost between windows: all but the first reading add up to the distance counted.
    assert sum(readings[1:]) * period == pytest.approx(distance, abs=1e-9)


def test_the_noise_is_the_declared_one_and_comes_from_the_seed() -> None:
    def readings(seed: float) -> np.ndarray:
        runtime = _started_at(10.0, noise_std=0.05, seed=seed)
        values = [outputs(runtime)["reading"]]
        for k in range(1, 2000):
            runtime.advance(k * 0.01)
            values.append(outputs(runtime)["reading"])
        return np.array(values)

    first = readings(5.0)
    np.testing.assert_allclose(
        first, 10.0 + 0.05 * np.array([standard_normal(5, 0, k) for k in range(2000)]), rtol=1e-14
    )
    np.testing.assert_array_equal(first, readings(5.0))
    assert np.abs(first - readings(6.0)).max() > 0.05
    assert first.std() == pytest.approx(0.05, rel=4.0 / np.sqrt(2.0 * 2000))  # four standard errors


def test_presets() -> None:
    assert started(ODOMETER, "10_hz").p[0] == 0.1
    assert list(started(ODOMETER, "pulses").p[[0, 3]]) == [0.1, 100.0]
