"""The tube against a naive second computation, and against pyfunnel on smooth signals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyfunnel  # type: ignore[import-untyped]
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cosim.comparison import tube
from cosim.comparison.curve import Curve
from cosim.comparison.tube import band_of, held_band

ROUNDING = 1e-12  # values are of size one; linear interpolation loses a few bits


def naive_band(time: np.ndarray, values: np.ndarray, at: float, tolerance: float) -> tuple[float, float]:
    """Extremes of the broken line over an interval: they are at its ends or at rows within it."""
    low, high = max(at - tolerance, time[0]), min(at + tolerance, time[-1])
    seen = [float(np.interp(low, time, values)), float(np.interp(high, time, values))]
    seen += [float(v) for t, v in zip(time, values, strict=True) if low <= t <= high]
    return min(seen), max(seen)


@st.composite
def lines(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray]:
    steps = draw(st.lists(st.floats(0.01, 1.0), min_size=1, max_size=30))
    values = draw(st.lists(st.floats(-1.0, 1.0), min_size=len(steps) + 1, max_size=len(steps) + 1))
    return np.append(0.0, np.cumsum(steps)), np.array(values)


@given(lines(), st.lists(st.floats(0.0, 5.0), min_size=1, max_size=20), st.floats(0.0, 3.0))
def test_band_is_that_of_the_naive_computation(
    line: tuple[np.ndarray, np.ndarray], at: list[float], tolerance: float
) -> None:
    time, values = line
    inside = np.array([t for t in at if t <= time[-1]] or [0.0])
    band = band_of(Curve(time, values), inside, tolerance)
    expected = np.array([naive_band(time, values, t, tolerance) for t in inside])
    assert band.evaluated.all()
    assert np.allclose(band.low, expected[:, 0], rtol=0.0, atol=ROUNDING)
    assert np.allclose(band.high, expected[:, 1], rtol=0.0, atol=ROUNDING)


@given(lines(), st.floats(0.0, 0.5))
def test_pieces_are_bands_of_their_own(line: tuple[np.ndarray, np.ndarray], tolerance: float) -> None:
    """Two pieces in one array give what each gives by itself."""
    time, values = line
    n = len(time)
    both = Curve(np.append(time, time + time[-1]), np.append(values, 10.0 - values))
    first, last = np.repeat([0, n], n), np.repeat([n, 2 * n], n)
    band = band_of(both, both.time, tolerance, first, last)
    alone = band_of(Curve(time, values), time, tolerance)
    assert np.array_equal(band.low[:n], alone.low)
    assert np.array_equal(band.high[:n], alone.high)
    assert np.all(band.low[n:] >= 9.0)


@given(lines(), st.floats(0.0, 3.0), st.booleans(), st.integers(1, 5))
def test_how_many_rows_are_looked_at_together_changes_no_bit(
    line: tuple[np.ndarray, np.ndarray], tolerance: float, held: bool, count: int
) -> None:
    """The bands at the rows themselves, and of a held curve those that hold all the time of a row."""
    curve = Curve(*line, held)
    first, last = np.zeros(len(line[0]), dtype=int), np.full(len(line[0]), len(line[0]))

    def bands() -> list[np.ndarray]:
        found = [band_of(curve, curve.time, tolerance, first, last)]
        found += [held_band(curve, tolerance, first, last)] if held else []
        return [array for band in found for array in (band.low, band.high, band.evaluated)]

    whole = bands()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tube, "_AT_A_TIME", count)
        parts = bands()
    for one, two in zip(whole, parts, strict=True):
        np.testing.assert_array_equal(one, two)


def test_beyond_the_ends_nothing_is_evaluated() -> None:
    band = band_of(Curve(np.array([0.0, 1.0]), np.array([0.0, 1.0])), np.array([-0.2, -0.05, 1.05, 1.2]), 0.1)
    assert band.evaluated.tolist() == [False, True, True, False]
    assert np.allclose(band.high, [0.0, 0.05, 1.0, 1.0], atol=ROUNDING)


def test_held_value_may_be_late_by_the_allowed_time_only() -> None:
    curve = Curve(np.array([0.0, 1.0, 2.0, 3.0]), np.array([5.0, 6.0, 7.0, 8.0]), held=True)
    rows = np.zeros(4, dtype=int), np.full(4, 4)
    assert held_band(curve, 0.0, *rows).low.tolist() == [5.0, 6.0, 7.0, 8.0]
    assert held_band(curve, 0.5, *rows).low[:3].tolist() == [5.0, 6.0, 7.0]
    assert held_band(curve, 0.7, *rows).low[:3].tolist() == [5.0, 6.0, 7.0]
    assert held_band(curve, 1.0, *rows).low[:3].tolist() == [5.0, 5.0, 6.0]
    assert held_band(curve, 1.0, *rows).high[:3].tolist() == [6.0, 7.0, 8.0]


def funnel(folder: Path, *curves: np.ndarray, wide: float, high: float) -> dict[str, np.ndarray]:
    """What pyfunnel writes: its lower and upper curve and its error; its return code says nothing."""
    pyfunnel.compareAndReport(*curves, str(folder), atolx=wide, atoly=high)
    names = {"lower": "lowerBound", "upper": "upperBound", "error": "errors"}
    return {key: np.loadtxt(folder / f"{name}.csv", delimiter=",", skiprows=1) for key, name in names.items()}


def test_tube_is_that_of_pyfunnel_on_a_smooth_signal(tmp_path: Path) -> None:
    time = np.linspace(0.0, 10.0, 401)
    reference = np.sin(time) + 0.3 * np.sin(3.1 * time)
    result = reference + 0.06 * np.cos(2.0 * time)
    seen = funnel(tmp_path, time, reference, time, result, wide=0.1, high=0.02)
    band = band_of(Curve(time, reference), time, 0.1)
    assert np.allclose(np.interp(time, *seen["lower"].T), band.low - 0.02, rtol=0.0, atol=ROUNDING)
    assert np.allclose(np.interp(time, *seen["upper"].T), band.high + 0.02, rtol=0.0, atol=ROUNDING)
    beyond = np.maximum(np.maximum(result - band.high, band.low - result) - 0.02, 0.0)
    assert beyond.max() > 0.02
    inner = (time > 0.1) & (time < 9.9)  # at the ends pyfunnel takes the tube as a closed shape
    assert np.allclose(np.interp(time, *seen["error"].T)[inner], beyond[inner], rtol=0.0, atol=ROUNDING)
