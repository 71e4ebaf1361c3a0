"""The slip ratio by the odometer, its guard and its conversion."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fmu_observer.detection import odometer_slip, speed_slip_from_odometer_slip

ROUNDING = 1e-12  # a handful of operations on numbers of order one


@pytest.mark.parametrize(
    ("by_odometer", "by_speed"), [(0.35, 0.35 / 0.65), (0.02, 0.02 / 0.98), (0.0, 0.0), (-1.0, -0.5)]
)
def test_conversion_matches_the_published_pairs(by_odometer: float, by_speed: float) -> None:
    assert speed_slip_from_odometer_slip(by_odometer) == pytest.approx(by_speed, abs=ROUNDING)


def test_thirty_five_percent_of_the_odometer_is_fifty_four_of_the_speed() -> None:
    assert speed_slip_from_odometer_slip(0.35) == pytest.approx(0.54, abs=0.005)  # printed with two digits


@given(speed=st.floats(1.0, 80.0), slip=st.floats(-0.9, 3.0))
def test_the_ratios_of_one_motion_convert_into_each_other(speed: float, slip: float) -> None:
    odometer = speed * (1.0 + slip)
    by_odometer = odometer_slip(odometer, speed, 1e-3)
    assert by_odometer == pytest.approx(slip / (1.0 + slip), rel=1e-9, abs=1e-9)  # 1 + slip - 1 loses a few digits
    assert speed_slip_from_odometer_slip(by_odometer) == pytest.approx(slip, rel=1e-9, abs=1e-9)


def test_guards_keep_standstill_and_wheel_lock_finite() -> None:
    assert odometer_slip(0.0, 10.0, 0.5) == -20.0
    assert odometer_slip(0.0, 10.0, 0.5) == odometer_slip(0.5, 10.5, 0.5)


def test_ratios_take_arrays() -> None:
    odometer, speed = np.array([0.0, 10.0, 20.0]), np.array([10.0, 10.2, 20.0])
    np.testing.assert_allclose(odometer_slip(odometer, speed, 0.5), [-20.0, -0.02, 0.0], atol=ROUNDING)
