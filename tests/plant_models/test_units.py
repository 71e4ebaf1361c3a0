"""Units: meanings and conversions against values worked out by hand from the definitions of the SI."""

from __future__ import annotations

import math
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from plant_models.hybrid.units import Unit, UnitError, conversion, parse_unit

# name: (powers of kg, m, s, A, K, mol, cd, rad; factor to SI)
BY_HAND = {
    "1": ((0, 0, 0, 0, 0, 0, 0, 0), 1.0),
    "": ((0, 0, 0, 0, 0, 0, 0, 0), 1.0),
    "%": ((0, 0, 0, 0, 0, 0, 0, 0), 0.01),
    "m/s": ((0, 1, -1, 0, 0, 0, 0, 0), 1.0),
    "m.s-1": ((0, 1, -1, 0, 0, 0, 0, 0), 1.0),
    "km/h": ((0, 1, -1, 0, 0, 0, 0, 0), 1000.0 / 3600.0),
    "m/s2": ((0, 1, -2, 0, 0, 0, 0, 0), 1.0),
    "m/s/s": ((0, 1, -2, 0, 0, 0, 0, 0), 1.0),
    "m/s^2": ((0, 1, -2, 0, 0, 0, 0, 0), 1.0),
    "kg.m2": ((1, 2, 0, 0, 0, 0, 0, 0), 1.0),
    "kg*m2/s3": ((1, 2, -3, 0, 0, 0, 0, 0), 1.0),
    "N.s2/m2": ((1, -1, 0, 0, 0, 0, 0, 0), 1.0),
    "J/(kg.K)": ((0, 2, -2, 0, -1, 0, 0, 0), 1.0),
    "(kN.m)/rad": ((1, 2, -2, 0, 0, 0, 0, -1), 1000.0),
    "kN": ((1, 1, -2, 0, 0, 0, 0, 0), 1000.0),
    "t.km2/h2": ((1, 2, -2, 0, 0, 0, 0, 0), 1000.0 * 1e6 / 3600.0**2),
    "1/s": ((0, 0, -1, 0, 0, 0, 0, 0), 1.0),
    "1 / s": ((0, 0, -1, 0, 0, 0, 0, 0), 1.0),
    "mm2": ((0, 2, 0, 0, 0, 0, 0, 0), 1e-6),
    "rpm": ((0, 0, -1, 0, 0, 0, 0, 1), 2.0 * math.pi / 60.0),
    "V": ((1, 2, -3, -1, 0, 0, 0, 0), 1.0),
    "mph": ((0, 1, -1, 0, 0, 0, 0, 0), 1609.344 / 3600.0),
    "bar": ((1, -1, -2, 0, 0, 0, 0, 0), 1e5),
    "J/degC": ((1, 2, -2, 0, -1, 0, 0, 0), 1.0),
    "degC/s": ((0, 0, -1, 0, 1, 0, 0, 0), 1.0),
}
ROUNDING = 1e-15  # two or three multiplications


@pytest.mark.parametrize("name", BY_HAND)
def test_a_unit_means_what_its_definition_says(name: str) -> None:
    exponents, factor = BY_HAND[name]
    unit = parse_unit(name)
    assert unit.exponents == exponents
    assert unit.factor == pytest.approx(factor, rel=ROUNDING)
    assert unit.offset == 0.0  # a temperature within a quotient is a difference


@pytest.mark.parametrize(
    ("source", "target", "value", "expected"),
    [
        ("km/h", "m/s", 36.0, 10.0),
        ("m/s", "km/h", 10.0, 36.0),
        ("permille", "%", 25.0, 2.5),
        ("degC", "K", 20.0, 293.15),
        ("K", "degC", 0.0, -273.15),
        ("rpm", "rad/s", 60.0, 2.0 * math.pi),
        ("deg", "rad", 180.0, math.pi),
        ("rad/s", "1/s", 3.0, 3.0),  # an angle is a pure number
        ("kN", "N", 1.5, 1500.0),
        ("t", "kg", 80.0, 80000.0),
        ("MW", "kW", 2.0, 2000.0),
        ("bar", "kPa", 1.0, 100.0),
        ("mm", "km", 5.0, 5e-6),
    ],
)
def test_conversions_by_hand(source: str, target: str, value: float, expected: float) -> None:
    factor, offset = conversion(parse_unit(source), parse_unit(target))
    assert factor * value + offset == pytest.approx(expected, rel=1e-14)  # a few roundings


def test_different_dimensions_are_refused_and_named() -> None:
    with pytest.raises(UnitError, match=r"different dimensions: m\.s-1 and kg\.m\.s-2"):
        conversion(parse_unit("km/h"), parse_unit("N"))


@pytest.mark.parametrize("name", ["furlong", "m/fortnight", "2m", "12", "-2", "%2", "m.", ".m", "kg..m", "10"])
def test_unknown_symbols_are_named(name: str) -> None:
    with pytest.raises(UnitError, match=r"unknown unit symbol '.*' in .*; known: "):
        parse_unit(name)


@pytest.mark.parametrize("name", ["m//s", "/s", "m/", "(m/s)2", "N/(m/s)", "m/(s", "m)/s", "((m))", "(m)2"])
def test_what_could_be_read_in_two_ways_is_refused(name: str) -> None:
    with pytest.raises(UnitError, match="cannot read unit"):
        parse_unit(name)


factors = st.floats(1e-6, 1e6)
offsets = st.floats(-1e3, 1e3)


@given(a=factors, b=factors, p=offsets, q=offsets, value=st.floats(-1e6, 1e6))
def test_there_and_back_is_the_identity(a: float, b: float, p: float, q: float, value: float) -> None:
    powers = (0, 0, 0, 0, 1, 0, 0, 0)
    source, target = Unit(powers, a, p), Unit(powers, b, q)
    there, back = conversion(source, target), conversion(target, source)
    converted = there[0] * value + there[1]
    # Each conversion is four operations; what is large on the way (the value and the shifts, in the source unit) is
    # rounded. Below the smallest normal number roundings are not relative any more.
    scale = max(abs(value) + (abs(p) + abs(q)) / a, max(b / a, 1.0) * sys.float_info.min)
    assert abs(back[0] * converted + back[1] - value) <= 16 * 2.0**-53 * scale


known = st.sampled_from(["kg", "m", "s", "A", "K", "mol", "cd", "rad", "km", "kN", "W", "ms", "h"])


@given(parts=st.lists(st.tuples(known, st.integers(-3, 3).filter(bool)), min_size=1, max_size=4))
def test_a_product_has_the_product_of_the_meanings(parts: list[tuple[str, int]]) -> None:
    whole = parse_unit(".".join(f"{symbol}{power}" for symbol, power in parts))
    factor = math.prod(parse_unit(symbol).factor ** power for symbol, power in parts)
    exponents = [sum(power * parse_unit(symbol).exponents[i] for symbol, power in parts) for i in range(8)]
    assert list(whole.exponents) == exponents
    assert whole.factor == pytest.approx(factor, rel=1e-14)  # a few roundings


@given(numerator=known, denominator=known)
def test_a_quotient_is_the_product_with_the_inverse(numerator: str, denominator: str) -> None:
    quotient, product = parse_unit(f"{numerator}/{denominator}"), parse_unit(f"{numerator}.{denominator}-1")
    assert quotient.exponents == product.exponents
    assert quotient.factor == pytest.approx(product.factor, rel=1e-15)
