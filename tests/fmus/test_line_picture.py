"""Pictures of curves: well-formed whatever is drawn, small, and true to the values."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fmus.tables.line_picture import Line, line_picture

VALUES = st.lists(st.floats(width=32), max_size=60)
WIDTH, HEIGHT = 632.0, 162.0


def paths(html: str) -> list[str]:
    """The curves, without the grid and the samples of the legend."""
    figure = ElementTree.fromstring(html)
    inner = figure.find("./svg/svg")
    assert inner is not None
    return [path.attrib["d"] for path in inner.iter("path")]


TEXTS = st.text(st.characters(exclude_categories=["Cn"]), max_size=20)


@given(st.lists(VALUES, max_size=4), TEXTS, st.booleans(), st.none() | st.floats(-10.0, 10.0))
def test_whatever_is_drawn_is_well_formed(
    columns: list[list[float]], label: str, held: bool, settled: float | None
) -> None:
    lines = [Line(label, np.arange(len(c), dtype=float), np.array(c), held=held) for c in columns]
    html = line_picture("a < b & c", lines, "time [s]", settled)
    drawn = [c for c in columns if np.isfinite(c).any()]
    assert bool(html) == bool(drawn)
    if html:
        assert len(paths(html)) == len(drawn)
        assert "nan" not in " ".join(paths(html))
        assert "inf" not in " ".join(paths(html))


@pytest.mark.parametrize("count", [1, 12, 300])
def test_it_is_small_whatever_the_number_of_rows_and_curves(count: int) -> None:
    time = np.linspace(0.0, 100.0, 200_000)
    noise = np.random.default_rng(0).standard_normal(len(time))
    html = line_picture("noise", [Line(f"curve {k}", time, noise + k) for k in range(count)])
    assert len(html) < 90_000
    assert ("and 288 more" in html) == (count == 300)


def test_points_stand_where_their_values_are() -> None:
    """The extremes of a long curve, one of them a single row, reach the ends of its axis; linear in between."""
    time = np.linspace(0.0, 1.0, 100_001)
    values = time.copy()
    values[50_000] = 3.0
    (path,) = paths(line_picture("a ramp", [Line("y", time, values)]))
    points = np.array(re.findall(r"[ML]([-\d.]+) ([-\d.]+)", path), dtype=float)
    low, high = -0.06 * 3.0, 1.06 * 3.0
    expected = HEIGHT * (high - 3.0) / (high - low)
    assert points[:, 1].min() == pytest.approx(expected, abs=0.06)
    assert points[np.argmin(points[:, 1]), 0] == pytest.approx(WIDTH / 2.0, abs=0.06)
    ramp = points[points[:, 1] > HEIGHT / 2.0]
    np.testing.assert_allclose(ramp[:, 1], HEIGHT * (high - ramp[:, 0] / WIDTH) / (high - low), atol=0.12)


def test_what_is_not_finite_is_a_gap_and_steps_are_steps() -> None:
    time, values = np.arange(5.0), np.array([0.0, 1.0, np.nan, 1.0, np.inf])
    (path,) = paths(line_picture("gaps", [Line("y", time, values)]))
    assert re.sub(r"[-\d. ]+", "", path) == "MhLMh"
    (path,) = paths(line_picture("steps", [Line("y", time[:2], values[:2], held=True)]))
    assert re.sub(r"[-\d. ]+", "", path) == "MhHV"


def test_the_axis_follows_what_is_settled() -> None:
    time = np.linspace(0.0, 10.0, 101)
    values = np.where(time < 1.0, 1e6, np.sin(time))
    start = line_picture("y", [Line("y", time, values)])
    later = line_picture("y", [Line("y", time, values)], settled=1.0)
    assert ">1e+06<" in start
    assert ">0.5<" in later
