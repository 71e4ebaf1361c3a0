"""A result is in SI, whatever units the FMUs record in."""

from __future__ import annotations

import numpy as np
import pytest

from cosim.results.result import SignalInfo
from cosim.results.si import _si_name, in_si
from plant_models.hybrid.units import Unit, UnitError, parse_unit

SIGNALS = [
    SignalInfo("train.speed", "km/h"),
    SignalInfo("train.position", "m"),
    SignalInfo("train.temperature", "degC", "degC"),
    SignalInfo("train.strange", "furlong"),
    SignalInfo("train.bare"),
]


def unit_of(name: str) -> Unit | None:
    info = next(s for s in SIGNALS if s.name == name)
    if info.name == "train.bare":
        return None
    if info.unit == "furlong":
        raise UnitError("furlong")
    return parse_unit(info.unit)


def test_columns_are_converted_and_say_so() -> None:
    table = np.zeros(2, dtype=[("time", float), *((s.name, float) for s in SIGNALS)])
    for s in SIGNALS:
        table[s.name] = [0.0, 36.0]
    table, signals = in_si(table, SIGNALS, unit_of)
    by_name = {s.name: s for s in signals}
    assert table["train.speed"].tolist() == pytest.approx([0.0, 10.0], rel=1e-15)  # 36 km/h are 10 m/s
    assert (by_name["train.speed"].unit, by_name["train.speed"].display_unit) == ("m/s", "km/h")
    assert table["train.temperature"].tolist() == pytest.approx([273.15, 309.15], rel=1e-15)
    assert (by_name["train.temperature"].unit, by_name["train.temperature"].display_unit) == ("K", "degC")
    for non_numeric in ("train.position", "train.strange", "train.bare"):
        assert table[non_numeric].tolist() == [0.0, 36.0]
        assert by_name[non_numeric] == next(s for s in SIGNALS if s.name == non_numeric)


@pytest.mark.parametrize(
    ("unit", "name"), [("km/h", "m/s"), ("kN", "N"), ("bar", "Pa"), ("%", "1"), ("rpm", "rad/s"), ("t.km2", "kg.m2")]
)
def test_the_si_unit_has_its_usual_name(unit: str, name: str) -> None:
    assert _si_name(parse_unit(unit)) == name


def test_an_unusual_unit_gets_a_name_of_equal_meaning() -> None:
    unit = parse_unit("kg.m5/s3")
    assert parse_unit(_si_name(unit)).exponents == unit.exponents
