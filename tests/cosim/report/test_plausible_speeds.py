"""Units that a run contradicts are named, and only these."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cosim.evaluation.plausible_speeds import speed_warnings
from cosim.evaluation.spec import ReportSpec
from cosim.results.result import Result

SPEC = ReportSpec(true_position="train.position", true_speed="train.speed", odometer="odometer.reading")


def run(position: np.ndarray, speed: np.ndarray, reading: np.ndarray, step: float) -> Result:
    """A run of 60 s with these signals, shape (rows,) each."""
    names = ("train.position", "train.speed", "odometer.reading")
    table = np.empty(len(speed), [("time", "f8"), *((name, "f8") for name in names)])
    table["time"] = 1e3 + step * np.arange(len(speed))
    for name, values in zip(names, (position, speed, reading), strict=True):
        table[name] = values
    return Result(table, [])


def journey(top: float, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Away, there, and a stop on the way: position [m] and speed [m/s]."""
    time = np.arange(0.0, 60.0, step)
    speed = top * np.interp(time, [0.0, 15.0, 25.0, 30.0, 35.0, 50.0, 60.0], [0.0, 1.0, 1.0, 0.0, 0.0, 0.7, 0.0])
    return np.concatenate(([0.0], np.cumsum(0.5 * step * (speed[1:] + speed[:-1])))), speed


@given(
    top=st.one_of(st.floats(3.0, 90.0), st.floats(-90.0, -3.0)),
    step=st.sampled_from([0.01, 0.1, 1.0]),
    wear=st.floats(0.9, 1.1),
    locked=st.floats(0.0, 0.25),
)
def test_wear_slip_and_coarse_rows_are_no_units(top: float, step: float, wear: float, locked: float) -> None:
    position, speed = journey(top, step)
    reading = wear * speed
    reading[: int(locked * len(reading))] = 0.0
    assert list(speed_warnings(run(position, speed, reading, step), SPEC)) == []


@pytest.mark.parametrize("top", [20.0, -20.0])
@pytest.mark.parametrize(("factor", "unit"), [(3.6, "km/h"), (1e3, "mm/s"), (1.0 / 3.6, ""), (-1.0, "")])
def test_a_reading_in_another_unit_is_named(top: float, factor: float, unit: str) -> None:
    position, speed = journey(top, 0.1)
    (text,) = speed_warnings(run(position, speed, factor * speed, 0.1), SPEC)
    assert text.startswith("odometer.reading reads")
    assert (f"({unit} taken for m/s?)" in text) == bool(unit)


@pytest.mark.parametrize(("way", "factor"), [(1.0, 3.6), (1e-3, 3.6), (1e-3, 1.0), (0.0, 1.0)])
def test_a_position_that_does_not_follow_the_speed_is_named(way: float, factor: float) -> None:
    position, speed = journey(20.0, 0.1)
    (text,) = speed_warnings(run(way * position, factor * speed, speed, 0.1), SPEC)
    assert text.startswith("train.speed and train.position do not go together")


def test_what_stands_or_is_not_recorded_says_nothing() -> None:
    still = np.zeros(100)
    assert list(speed_warnings(run(still, still, still, 0.1), SPEC)) == []
    assert list(speed_warnings(run(still, still + 20.0, still, 0.1), ReportSpec())) == []
