"""Doppler radar and brake pressure sensor: their errors in closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from plant_models.railway.sensors.lagged_sensors import BrakePressureSensor, DopplerRadar


def read(sensor: Any, value: float, noise: np.ndarray, **settings: float) -> np.ndarray:
    """Readings of a constant value, one for each noise, shape (members,)."""
    p = sensor.unpack_parameters(sensor.start_parameters())._replace(**settings)
    names = [s.name for s in sensor.inputs]
    u = sensor.unpack_inputs(np.zeros(len(sensor.input_signals)))._replace(**{names[0]: value, "reading_noise": noise})
    x = sensor.unpack_states(np.stack([np.full(noise.shape, value), np.zeros(noise.shape)]))
    return np.asarray(sensor.output(0.0, x._replace(**sensor.jump("sampling", 0.0, x, u, p)), u, p)["reading"])


def test_the_radar_has_a_scale_and_noise_that_grows_with_the_speed() -> None:
    noise = np.array([0.0, 1.0, -2.0])
    expected = 20.0 * 1.002 + noise * (0.005 * 20.0 + 0.01)
    assert read(DopplerRadar(), 20.0, noise) == pytest.approx(expected, abs=1e-12)
    assert (read(DopplerRadar(), 0.09, noise) == 0.0).all()  # too slow to be seen


def test_the_pressure_sensor_has_steps_and_a_span() -> None:
    sensor, quiet = BrakePressureSensor(), np.zeros(1)
    expected = round((3e5 * 1.0017 + 1700.0) / 244.0) * 244.0
    assert read(sensor, 3e5, quiet)[0] == pytest.approx(expected, abs=1e-9)
    assert read(sensor, 3e5, quiet, resolution=0.0)[0] == pytest.approx(3e5 * 1.0017 + 1700.0, abs=1e-9)
    assert read(sensor, 1.2e6, quiet, resolution=0.0)[0] == 1e6
    assert read(sensor, 0.0, np.full(1, -9.0))[0] == 0.0
