"""Adhesion curves against the thesis' tables and closed forms, and the laws every curve obeys."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plant_models.railway.adhesion import (
    BURCKHARDT_DEGRADED,
    BURCKHARDT_NOMINAL,
    POLACH_DRY,
    POLACH_WET,
    BurckhardtCurve,
    PolachCurve,
)

WEIGHT = 90e3 * 9.81  # [N]
# Bouchama 2024, Table 4.5: V [km/h], mu_max dry, optimal slip dry [%], mu_max wet, optimal slip wet [%]
TABLE_4_5 = (
    (5, 0.3894, 10.0, 0.2188, 30.4),
    (10, 0.3474, 8.0, 0.1961, 20.0),
    (20, 0.3027, 4.8, 0.1713, 14.4),
    (30, 0.2769, 4.0, 0.1566, 12.0),
    (40, 0.2594, 3.2, 0.1463, 9.6),
    (50, 0.2449, 3.2, 0.1387, 7.2),
)
ROWS = [(POLACH_DRY, v, mu, slip) for v, mu, slip, _, _ in TABLE_4_5] + [
    (POLACH_WET, v, mu, slip) for v, _, _, mu, slip in TABLE_4_5
]
TRUNCATED = {(5, 10.0), (10, 20.0)}  # printed slips that are cut from 10.4 and 20.8 %


@pytest.mark.parametrize(("curve", "kmh", "coefficient", "percent"), ROWS)
def test_polach_peaks_are_those_of_table_4_5(
    curve: PolachCurve, kmh: float, coefficient: float, percent: float
) -> None:
    slip, peak = curve.peak(kmh / 3.6)
    # The print took its peaks from a slip grid of 0.8 %: 0.6 % of mu and 1.8 points of slip are what that grid
    # explains.
    assert peak == pytest.approx(coefficient, rel=6e-3)
    assert 100.0 * slip == pytest.approx(percent, abs=1.8)


@pytest.mark.parametrize(("curve", "kmh", "coefficient", "percent"), ROWS)
def test_polach_at_the_printed_slips_gives_the_printed_digits(
    curve: PolachCurve, kmh: float, coefficient: float, percent: float
) -> None:
    tolerance = 5e-4 if (kmh, percent) in TRUNCATED else 2e-4
    assert curve.coefficient(percent / 100.0, kmh / 3.6) == pytest.approx(coefficient, abs=tolerance)


@pytest.mark.parametrize("kmh", [5.0, 50.0])
def test_polach_in_metres_per_second_would_miss_the_printed_optimal_slips(kmh: float) -> None:
    as_metres = PolachCurve(1.0, 0.4, 0.55, 0.4, 0.6 / 3.6, 25.0 / 3.6)  # the same maxima, decay per m/s
    slip, peak = as_metres.peak(kmh / 3.6)
    printed = next(row for row in TABLE_4_5 if row[0] == kmh)
    assert peak == pytest.approx(printed[1], rel=6e-3)
    assert 100.0 * slip > 2.5 * printed[2]  # so the table decides the unit


@pytest.mark.parametrize(
    ("curve", "peak", "slip", "slope", "at_one", "force"),
    [  # independently measured; digits as quoted
        (BURCKHARDT_NOMINAL, 0.39086, 0.10115, 16.848, 0.1287, 345.1e3),
        (BURCKHARDT_DEGRADED, 0.14612, 0.14879, 4.025, 0.0650, 129.0e3),
    ],
)
def test_burckhardt_peaks_slopes_and_forces(
    curve: BurckhardtCurve, peak: float, slip: float, slope: float, at_one: float, force: float
) -> None:
    assert curve.peak_slip() == pytest.approx(slip, abs=5e-6)
    assert curve.peak() == pytest.approx(peak, abs=5e-6)
    assert curve.coefficient(curve.peak_slip()) == pytest.approx(curve.peak(), rel=1e-14)
    assert curve.initial_slope() == pytest.approx(slope, abs=5e-4)
    assert curve.coefficient(1.0) == pytest.approx(at_one, abs=5e-5)
    assert curve.peak() * WEIGHT == pytest.approx(force, abs=60.0)


@pytest.mark.parametrize(("slip", "force"), [(0.01, 31.3e3), (0.015, 44.2e3), (0.02, 55.6e3)])
def test_degraded_burckhardt_forces_at_small_slip(slip: float, force: float) -> None:
    assert BURCKHARDT_DEGRADED.coefficient(slip) * WEIGHT == pytest.approx(force, abs=50.0)  # three digits are quoted


def test_burckhardt_follows_the_printed_formula_for_positive_slip() -> None:
    slips = np.linspace(0.0, 1.0, 101)
    printed = 0.4287 * (1.0 - np.exp(-40.0 * slips)) - 0.3 * slips
    np.testing.assert_allclose(BURCKHARDT_NOMINAL.coefficient(slips), printed, rtol=1e-13, atol=1e-15)


CURVES = {
    "burckhardt_nominal": lambda s, _: BURCKHARDT_NOMINAL.coefficient(s),
    "burckhardt_degraded": lambda s, _: BURCKHARDT_DEGRADED.coefficient(s),
    "polach_dry": POLACH_DRY.coefficient,
    "polach_wet": POLACH_WET.coefficient,
}


@pytest.mark.parametrize("name", CURVES)
@given(slip=st.floats(-1e6, 1e6), speed=st.floats(1e-3, 150.0))
def test_every_curve_is_odd_bounded_and_never_against_the_slip(name: str, slip: float, speed: float) -> None:
    value = float(CURVES[name](slip, speed))
    assert value == -float(CURVES[name](-slip, speed))
    assert value * slip >= 0.0
    assert abs(value) < 0.56  # mu0 of the dry Polach curve is the largest coefficient there is


@pytest.mark.parametrize("curve", [BURCKHARDT_NOMINAL, BURCKHARDT_DEGRADED])
@given(slip=st.floats(1.0, 1e9))
def test_burckhardt_keeps_the_value_of_a_sliding_wheel_beyond_full_slip(curve: BurckhardtCurve, slip: float) -> None:
    assert curve.coefficient(slip) == curve.coefficient(1.0) > 0.0


@pytest.mark.parametrize("name", CURVES)
def test_curves_evaluate_alike_on_numbers_arrays_and_symbols(name: str) -> None:
    slips, speeds = np.linspace(-2.0, 2.0, 41), np.linspace(0.5, 50.0, 41)
    array = CURVES[name](slips, speeds)
    s, v = ca.SX.sym("s"), ca.SX.sym("v")
    wrapped = (ca.ArrayInterface.SX(s, shape=()), ca.ArrayInterface.SX(v, shape=()))
    traced = ca.Function("curve", [s, v], [ca.SX(CURVES[name](*wrapped))])
    for i in range(len(slips)):
        assert array[i] == pytest.approx(float(CURVES[name](slips[i], speeds[i])), rel=1e-13, abs=1e-15)
        assert float(traced(slips[i], speeds[i])) == pytest.approx(array[i], rel=1e-13, abs=1e-15)


@pytest.mark.parametrize(
    ("name", "slope"),
    [
        ("burckhardt_nominal", BURCKHARDT_NOMINAL.initial_slope()),
        ("burckhardt_degraded", BURCKHARDT_DEGRADED.initial_slope()),
        ("polach_dry", POLACH_DRY.initial_slope()),
        ("polach_wet", POLACH_WET.initial_slope()),
    ],
)
def test_the_traced_derivative_at_zero_slip_is_the_closed_form_slope(name: str, slope: float) -> None:
    s = ca.SX.sym("s")
    expression = ca.SX(CURVES[name](ca.ArrayInterface.SX(s, shape=()), 10.0))
    derivative = ca.Function("slope", [s], [ca.jacobian(expression, s)])
    assert float(derivative(0.0)) == pytest.approx(slope, rel=1e-12)  # the stiffness the implicit step lives on


def test_a_peak_needs_a_speed() -> None:
    with pytest.raises(ValueError, match=r"positive speed, got 0\.0 m/s"):
        POLACH_DRY.peak(0.0)


@pytest.mark.parametrize(("curve", "kmh"), [(POLACH_DRY, 120.0), (POLACH_WET, 160.0)])
def test_the_peak_is_the_first_maximum_where_a_spinning_wheel_finds_more(curve: PolachCurve, kmh: float) -> None:
    slip, peak = curve.peak(kmh / 3.6)
    assert slip < 0.1
    assert curve.coefficient(10.0, kmh / 3.6) > peak  # what a search for the largest value would return
    assert max(curve.coefficient(slip * f, kmh / 3.6) for f in (0.98, 1.02)) < peak
