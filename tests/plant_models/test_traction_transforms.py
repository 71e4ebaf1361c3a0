"""Clarke, Concordia, rotation and Park: inverses, lengths, power."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plant_models.railway.traction import (
    clarke,
    concordia,
    inverse_clarke,
    inverse_concordia,
    inverse_park,
    park,
    to_rotor,
    to_stator,
)

ROUNDING = 1e-12  # some tens of operations on numbers up to 1e3
PHASES = st.tuples(*(st.floats(-1e3, 1e3) for _ in range(3)))
ANGLES = st.floats(-50.0, 50.0)


@given(PHASES, ANGLES)
def test_round_trips(phases: tuple[float, float, float], angle: float) -> None:
    near = lambda got, wanted: np.testing.assert_allclose(got, wanted, rtol=ROUNDING, atol=1e3 * ROUNDING)  # noqa: E731
    near(inverse_clarke(*clarke(*phases)), phases)
    near(inverse_concordia(*concordia(*phases)), phases)
    near(to_stator(*to_rotor(*phases[:2], angle), angle), phases[:2])
    near(park(*inverse_park(*phases[:2], angle), angle), phases[:2])


@given(PHASES, PHASES)
def test_power(voltages: tuple[float, float, float], currents: tuple[float, float, float]) -> None:
    """Concordia keeps it; Clarke needs 3/2, and 3 for the zero component."""
    power = np.dot(voltages, currents)
    assert np.dot(concordia(*voltages), concordia(*currents)) == pytest.approx(power, abs=1e-6)
    v, i = clarke(*voltages), clarke(*currents)
    assert 1.5 * np.dot(v[:2], i[:2]) + 3.0 * v[2] * i[2] == pytest.approx(power, abs=1e-6)


@given(st.floats(0.1, 1e3), ANGLES, ANGLES)
def test_balanced_phases_keep_their_amplitude_and_stand_still_in_the_rotor_frame(
    amplitude: float, angle: float, ahead: float
) -> None:
    phases = [amplitude * np.cos(angle + ahead - k * 2.0 * np.pi / 3.0) for k in range(3)]
    got = park(*phases, angle)
    np.testing.assert_allclose(got, amplitude * np.array([np.cos(ahead), np.sin(ahead)]), atol=1e-10 * amplitude)
    assert np.hypot(*clarke(*phases)[:2]) == pytest.approx(amplitude)
    assert np.hypot(*concordia(*phases)[:2]) == pytest.approx(np.sqrt(1.5) * amplitude)
