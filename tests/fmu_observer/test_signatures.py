"""Graphical signatures: the pencil map against its printed check values and a second way to compute it, its laws, and
signatures of many records at once.
"""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fmu_observer.formulas.signatures.dynamic_signature import dynamic_signature
from fmu_observer.formulas.signatures.pencil import pencil, pencil_point

TINY = 1e-13  # eps -> 0, as the check values are
SAMPLES = st.lists(st.floats(-100.0, 100.0), min_size=3, max_size=9).filter(lambda v: max(map(abs, v[:-1])) > 1e-3)


def printed(past, following, eps, next_scaling):
    """The map with complex numbers, line by line as Omar 2012, (2.3.1)-(2.3.6), prints it."""
    size = max(abs(v) for v in past)
    scaled = [v / (size + eps) for v in past]
    count = len(past)
    corners = [np.exp(2j * np.pi * i / count) for i in range(count)]
    psi = [0.5 * ((1 + y) * corners[(i + 1) % count] - (y - 1) * corners[i]) for i, y in enumerate(scaled)]
    centre, weighted = sum(psi) / count, sum(y * q for y, q in zip(scaled, psi, strict=True)) / count
    divisor = (size if next_scaling == "norm" else max(abs(v) for v in scaled)) + eps
    return centre + (following / divisor - sum(scaled) / count) * (weighted - centre)


def test_edge_points_are_those_of_figure_2_6():
    points = pencil(np.array([0.0, 0.5, -0.5, 0.25, -0.25, 0.0]), 0.0, 0.5).edge_points  # 0.5 + eps = 1: scaled by 1
    half = np.sqrt(3.0) / 2.0
    expected = [[0.75, -0.25, -0.625, -0.6875, -0.125, 0.75]]
    expected += [[half / 2, half, 0.75 * half, -0.625 * half, -half, -half / 2]]
    np.testing.assert_allclose(points, expected, atol=1e-15)  # rounding


@pytest.mark.parametrize(
    ("next_scaling", "points"),
    [
        ("norm", [(-0.2144, -0.0776), (-0.0811, 0.0321), (0.0522, 0.1418)]),
        ("literal", [(-0.7478, -0.5163), (-0.0811, 0.0321), (0.5856, 0.5806)]),
    ],
)
def test_points_are_those_of_figure_2_7(next_scaling, points):
    past = np.tile([[5.0], [2.0], [0.0], [-1.0], [3.0], [-2.0]], 3)
    found = pencil_point(past, np.array([-5.0, 0.0, 5.0]), TINY, next_scaling)
    np.testing.assert_allclose(found.T, points, atol=5e-5)  # printed to four digits


@given(SAMPLES, st.floats(1e-4, 2.0), st.sampled_from(["norm", "literal"]))
def test_closed_form_is_the_printed_sum(samples, eps, next_scaling):
    *past, following = samples
    expected = printed(past, following, eps, next_scaling)
    point = pencil_point(np.array(past), following, eps, next_scaling)
    scale = 1e-13 * (1.0 + abs(expected))  # a dozen roundings
    assert abs(point[0] - expected.real) < scale
    if len(past) > 2:
        assert abs(point[1] - expected.imag) < scale
        np.testing.assert_allclose(pencil(past, following, eps, next_scaling).point, point, atol=scale)


@given(SAMPLES, st.floats(0.1, 10.0))
def test_norm_scaling_does_not_see_the_size_of_a_signal(samples, factor):
    values = np.array(samples)
    np.testing.assert_allclose(
        pencil_point(values[:-1] * factor, values[-1] * factor, 1e-3 * factor),
        pencil_point(values[:-1], values[-1], 1e-3),
        rtol=1e-10,
        atol=1e-12,
    )


def test_two_past_samples_have_the_weight_of_the_second_vertex_for_an_ordinate():
    # The second vertex is -1 + 1.2246e-16 j in floating point: the ordinate that the thesis saw is this many times it.
    rounding = np.exp(1j * np.pi).imag
    rng = np.random.default_rng(4)
    for past in rng.normal(size=(20, 2)):
        following = rng.normal()
        point = pencil_point(past, following, 0.01)
        seen = printed(past, following, 0.01, "norm")
        assert abs(point[1] * rounding - seen.imag) < 1e-28 + 1e-3 * abs(seen.imag)


def test_signatures_of_many_records_are_those_of_each():
    records = np.random.default_rng(1).normal(size=(30, 4, 3))
    together = dynamic_signature(records, 6)
    assert together.shape == (2, 24, 4, 3)
    np.testing.assert_array_equal(together[:, :, 1, 2], dynamic_signature(records[:, 1, 2], 6))
    first = pencil_point(records[:6, 1, 2], records[6, 1, 2])  # from the oldest to the newest
    np.testing.assert_allclose(together[:, 0, 1, 2], first, rtol=1e-13)


def test_a_point_traces():
    symbols = ca.ArrayInterface.SX(ca.SX.sym("y", 7), shape=(7,))
    values = np.random.default_rng(2).normal(size=7)
    for next_scaling in ("norm", "literal"):
        point = pencil_point(symbols[:6], symbols[6], 0.1, next_scaling)
        traced = ca.Function("point", [symbols.to_casadi()], [ca.SX(point.to_casadi())])
        expected = pencil_point(values[:6], values[6], 0.1, next_scaling)
        np.testing.assert_allclose(traced(values).full().ravel(), expected, atol=1e-15)


@pytest.mark.parametrize(
    ("record", "order", "said"),
    [
        (np.zeros(5), 5, "needs 6 samples at least, the record has 5"),
        (np.zeros(5), 1, "needs 2 past samples"),
        (3.0, 2, "the record has 0"),
        ([0.0, 1.0, np.nan, 2.0], 2, "sample 2 of the record is not finite"),
    ],
)
def test_what_has_no_signature_is_reported(record, order, said):
    with pytest.raises(ValueError, match=said):
        dynamic_signature(record, order)


def test_an_unknown_scaling_is_reported():
    with pytest.raises(ValueError, match="'norm' or 'literal'"):
        pencil_point(np.ones(3), 1.0, 0.1, "Norm")
