"""Envelopes of signatures and the distance to them: what encloses, what an exact shape gives, the bars of Figures 4.8
and 4.9, and a line sampled point by point.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fmu_observer.formulas.signatures.envelope import (
    _rotated,
    best_envelope,
    envelope,
    envelope_areas,
    envelope_distance,
    line_distance,
)

LENGTH, THICKNESS, GAP = 4.0, 0.2, 0.5


def bar() -> np.ndarray:
    """Points that fill a bar, in a grid of which the borders are part."""
    x, y = np.meshgrid(np.linspace(0.0, LENGTH, 81), np.linspace(0.0, THICKNESS, 5))
    return np.stack([x.ravel(), y.ravel()])


def bent() -> np.ndarray:
    t = np.linspace(0.0, 1.0, 900)
    return np.stack([np.cos(2.0 * t) * 5.0, 8.0 * t + np.sin(40.0 * t) * 0.2])


@settings(max_examples=25)
@given(st.integers(0, 10_000), st.integers(1, 12), st.floats(0.0, np.pi))
def test_an_envelope_holds_all_its_points(seed, slabs, angle):
    points = np.random.default_rng(seed).normal(size=(2, 40))
    found = envelope(points, slabs, angle)
    assert len(found.lower) == slabs
    turned = envelope(_rotated(points, angle), slabs)  # no rounding of a second rotation
    assert turned.contains(_rotated(points, angle)).all()
    np.testing.assert_allclose(found.area, turned.area, rtol=1e-12)
    assert 0.0 <= found.area <= envelope(points, 1, angle).area * (1.0 + 1e-12)


def test_slabs_are_equally_populated():
    points = np.random.default_rng(0).normal(size=(2, 90))
    edges = envelope(points, 30).edges
    assert [np.sum((points[0] > a) & (points[0] <= b)) for a, b in pairwise(edges)] == [2] + [
        3
    ] * 29  # the first: a point on its edge
    assert edges[0] == points[0].min()
    assert edges[-1] == points[0].max()


def test_a_turned_bar_has_its_area_at_its_own_angle():
    filled = np.random.default_rng(2).uniform(0.0, 1.0, size=(2, 2000)) * [[LENGTH], [THICKNESS]]
    points = _rotated(filled, np.radians(30.0))
    found = best_envelope(points, 10)
    # 200 points a slab leave 1 % of the height empty at each end, the edges less.
    assert 0.97 * LENGTH * THICKNESS < found.area < LENGTH * THICKNESS
    corners = found.corners
    assert found.contains(corners.mean(axis=2)).all()  # the middle of each slab
    np.testing.assert_allclose(_rotated(corners, found.angle)[1, :, 2], found.upper, atol=1e-12)
    # Lying along the abscissa or standing on it, the sum is the same: both are the bar.
    assert min(abs(found.angle - np.radians(a)) for a in (60.0, 150.0)) < np.radians(2.0)
    assert envelope_areas(points, 10, np.array([0.0]))[0] > 1.5 * found.area


def test_the_best_angle_is_the_smallest_of_all():
    areas = envelope_areas(bent(), 30)
    assert best_envelope(bent(), 30).area == areas.min()
    assert areas.min() < 0.6 * areas[0]  # a bent signature as in Figs. 4.2-4.7: 19.9 and 6.75 for theirs


def test_distances_along_a_line_are_those_of_figures_4_8_and_4_9():
    box = envelope(bar(), 8)
    above, beside = np.array([LENGTH / 3.0, THICKNESS + GAP]), np.array([LENGTH + GAP, THICKNESS / 2.0])
    assert line_distance(above, box, np.pi / 2) == pytest.approx(GAP / THICKNESS, rel=1e-12)
    assert line_distance(beside, box, 0.0) == pytest.approx(GAP / LENGTH, rel=1e-12)
    assert line_distance(above, box, 0.0) == np.inf
    on_border = np.array([box.edges[3], THICKNESS + GAP])  # in one slab, not in two
    assert line_distance(on_border, box, np.pi / 2) == pytest.approx(GAP / THICKNESS, rel=1e-12)
    # All lines that cross both sides of the bar give the same quotient, the others a larger one.
    assert envelope_distance(above, box) == pytest.approx(GAP / THICKNESS, rel=1e-9)
    assert envelope_distance(beside, box) == pytest.approx(GAP / LENGTH, rel=1e-9)
    assert envelope_distance(beside, box) < envelope_distance(above, box)


def test_the_distance_does_not_depend_on_the_frame():
    points = np.random.default_rng(3).uniform(-2.0, 6.0, size=(2, 20))
    straight, turned = envelope(bar(), 8), envelope(_rotated(bar(), 0.7), 8, -0.7)
    for direction in (0.0, 0.3, 1.2):
        expected = line_distance(points, straight, direction)
        found = line_distance(_rotated(points, 0.7), turned, direction + 0.7)
        np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_a_line_is_that_of_its_points():
    shape = envelope(bent(), 12, 0.4)
    r = np.linspace(-25.0, 25.0, 20_001)
    step = r[1] - r[0]
    for point in np.random.default_rng(5).uniform(-8.0, 8.0, size=(12, 2)):
        for direction in (0.1, 0.9, 2.0):
            ray = point[:, None] + r * np.array([[np.cos(direction)], [np.sin(direction)]])
            inside = shape.contains(ray)
            found = float(line_distance(point, shape, direction))
            if not inside.any():
                continue
            nearest, length = np.abs(r[inside]).min(), inside.sum() * step
            low, high = (nearest - step) / (length + 24 * step), (nearest + step) / max(length - 24 * step, 1e-9)
            assert low <= found <= high  # an end of each slab may lie between two points of the ray


def test_points_within_have_no_distance():
    shape = best_envelope(bent(), 30)
    inner = bent()[:, 100:800:50]
    assert np.all(envelope_distance(inner, shape) <= 1e-12)


@pytest.mark.parametrize(
    ("points", "slabs", "said"),
    [
        (np.zeros((2, 5)), 6, "6 slabs for 5 points"),
        (np.zeros((3, 5)), 2, r"shape \(2, N\)"),
        (np.full((2, 5), np.nan), 2, "not finite"),
    ],
)
def test_what_has_no_envelope_is_reported(points, slabs, said):
    with pytest.raises(ValueError, match=said):
        envelope(points, slabs)
