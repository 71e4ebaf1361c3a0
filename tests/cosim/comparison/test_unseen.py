"""A result with fewer rows than the reference: an honest one passes, and what it cannot show is not called equal."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_results import compared, kinds, made

from cosim.comparison.common_change import common_changes
from cosim.comparison.comparison_text import comparison_text
from cosim.comparison.tolerance import Tolerance

DEFAULT = Tolerance()
TIME = np.arange(601) * 0.01
CURVES: dict[str, Callable[[float], np.ndarray]] = {
    "sine": lambda at: np.sin(TIME - at),
    "parabola": lambda at: (TIME - at) ** 2,
    "kinks": lambda at: np.interp(TIME, [0.0, at, at + 0.7, 6.0], [0.0, 1.0, -2.0, -2.0]),
    "step": lambda at: np.where(at < TIME, 3.7, 0.2),
    "lag": lambda at: np.where(at < TIME, 1.0 - np.exp(-(TIME - at)), 0.0),
    "stairs": lambda at: np.floor(TIME / (0.2 + 0.1 * at)),
}


@settings(deadline=None, max_examples=40)
@given(st.sampled_from(list(CURVES)), st.floats(0.5, 5.0), st.sampled_from([2, 3, 4, 5, 6, 10, 12, 15, 20]))
def test_an_honest_result_with_fewer_rows_passes(curve: str, at: float, every: int) -> None:
    values = CURVES[curve](at)
    discrete = ["y"] if curve == "stairs" else []
    fewer = made(TIME[::every], discrete=discrete, y=values[::every])
    found = compared(made(TIME, discrete=discrete, y=values), fewer, DEFAULT)
    assert found.equal, found
    assert f"Compared at {600 // every + 1} instants, those of result; reference has 601." in found.notes


@settings(deadline=None, max_examples=40)
@given(st.booleans(), st.integers(2, 60), st.integers(1, 599), st.integers(1, 8))
def test_what_the_reference_does_between_two_rows_is_not_called_equal(
    held: bool, every: int, row: int, length: int
) -> None:
    rows = np.arange(row, min(row + length, 600))
    rows = rows[rows % every != 0]
    values = np.zeros(601) if held else 0.1 * TIME
    other = values.copy()
    other[rows] += 1.0
    kept = np.append(np.arange(0, 600, every), 600)
    fewer = made(TIME[kept], discrete=["y"] if held else [], y=values[kept])
    found = compared(made(TIME, discrete=["y"] if held else [], y=other), fewer, DEFAULT)
    assert found.equal == (not len(rows))
    assert not len(rows) or "gap" in kinds(found["y"])
    assert compared(fewer, made(TIME, discrete=["y"] if held else [], y=other), DEFAULT).equal  # a thinned baseline


def test_of_two_rows_it_is_said_that_they_are_too_few() -> None:
    wild = made(TIME, y=np.where(TIME % 6.0 == 0.0, TIME, TIME + 50.0), units={"y": "m"})
    found = compared(wild, made(TIME[[0, -1]], y=TIME[[0, -1]], units={"y": "m"}), DEFAULT)
    (one,) = found["y"].findings
    assert one.text == (
        "y: from 0.01 to 5.99 s the reference moves between two rows of the result, at worst by 50 m at "
        f"{one.worst:.9g} s (allowed 0.005599 m); too few rows to be compared"
    )
    assert one.size == pytest.approx(50.0)


def test_what_is_not_seen_is_no_change_of_the_values() -> None:
    spike = np.where(np.arange(601) == 301, 7.5, 0.0)
    found = compared(made(TIME, y=spike), made(TIME[::2], y=spike[::2]), DEFAULT)
    assert kinds(found["y"]) == ["gap"]
    assert common_changes(found) == []
    assert "y: at 3.01 s the reference moves between two rows of the result, by 7.5 (allowed" in comparison_text(found)
