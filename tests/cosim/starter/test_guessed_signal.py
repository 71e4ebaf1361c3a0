"""Guesses: signals as vendors name them, in several languages and units, and what must not be taken for them."""

from __future__ import annotations

import pytest

from cosim.starter.guessed_signal import UNITS, WORDS, GuessedSignal, Quantity, _words_of, guess
from plant_models.hybrid.units import parse_unit


def signal(name: str, unit: str | None = None, description: str = "") -> GuessedSignal:
    return GuessedSignal(name, unit, None if unit is None else parse_unit(unit), description)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("vTrain", ["v", "train"]),
        ("train.body_1.V", ["train", "body", "v"]),
        ("HTTPSpeed", ["http", "speed"]),
        ("Fahrzeug-Größe", ["fahrzeug", "grosse"]),
        ("vélocité", ["velocite"]),
        ("x2", ["x"]),
    ],
)
def test_words_of_a_name(text: str, words: list[str]) -> None:
    assert _words_of(text) == words


def test_a_stated_meaning_decides() -> None:
    """Over names, units and descriptions that speak for another one."""
    misleading = GuessedSignal("y7", stated="speed")
    named = signal("v_train", "m/s", "speed of the train")
    found = guess("speed", [named, misleading])
    assert found is not None
    assert (found.signal, found.sureness) == (misleading, "sure")
    assert guess("position", [GuessedSignal("s", stated="speed")]) is None


NAMED: list[tuple[Quantity, str, str | None]] = [
    ("position", "Position", "m"),
    ("position", "train.s", "m"),
    ("position", "Weg", "km"),
    ("position", "abscisse_tete", "m"),
    ("position", "x_zug", "m"),
    ("position", "posizione", None),
    ("speed", "v", "m/s"),
    ("speed", "vehicle.vel", "km/h"),
    ("speed", "Geschwindigkeit_Zug", "km/h"),
    ("speed", "vitesse", None),
    ("speed", "TrainSpeed", "mph"),
    ("speed", "velocità", "m/s"),
    ("wheel_speed", "vRad", "m/s"),
    ("wheel_speed", "axle1.speed", "m/s"),
    ("wheel_speed", "omega_wheel", "rad/s"),
    ("wheel_speed", "odometer", "m/s"),
    ("wheel_speed", "Vitesse_roue", "km/h"),
    ("wheel_speed", "axle_speed", "rpm"),
    ("effort", "F_trac", "N"),
    ("effort", "Zugkraft", "kN"),
    ("effort", "effort_traction", "N"),
    ("effort", "TractiveForce", None),
    ("effort", "trac_brake_force", "N"),
    ("slip", "Schlupf", "%"),
    ("adhesion_force", "Haftkraft", "kN"),
    ("adhesion_force", "force_adhesion", None),
    ("mass", "m", "kg"),
    ("mass", "Masse", "t"),
]


@pytest.mark.parametrize(("quantity", "name", "unit"), NAMED)
def test_a_signal_is_known_by_its_name_and_unit(quantity: Quantity, name: str, unit: str | None) -> None:
    others = [signal("temperature", "K"), signal("angle", "rad"), signal("flag"), signal("pressure", "bar")]
    found = guess(quantity, [*others, signal(name, unit)])
    assert found is not None
    assert found.signal.name == name
    assert found.sureness in (("likely",) if unit is None else ("sure", "likely"))


STRANGERS: list[tuple[Quantity, str, str | None, str]] = [
    ("position", "radius", "mm", "wheel radius"),
    ("position", "x", "kg", ""),
    ("position", "wheel_position", "m", ""),
    ("position", "s", None, ""),
    ("speed", "v", "V", "voltage"),
    ("speed", "v_ref", "m/s", ""),
    ("speed", "wheel_speed", "m/s", ""),
    ("speed", "speed_limit", "m/s", ""),
    ("speed", "speed", "rad/s", "of a shaft"),
    ("speed", "u1", "m/s", "wind speed"),
    ("wheel_speed", "speed", "m/s", ""),
    ("wheel_speed", "wheel_radius", "m", ""),
    ("wheel_speed", "wheel_load", None, ""),
    ("effort", "brake_force", "N", ""),
    ("effort", "torque", "N.m", ""),
    ("effort", "adhesion_force", "N", ""),
    ("slip", "y", None, ""),
    ("adhesion_force", "adhesion_degraded", None, "0 nominal .. 1 degraded adhesion"),
    ("adhesion_force", "adhesion", None, ""),
    ("adhesion_force", "adhesion_coefficient", "1", "adhesion force over load"),
    ("mass", "x", "kg", ""),
]
UNSURE = {("position", "radius"), ("position", "s"), ("speed", "u1")}


@pytest.mark.parametrize(("quantity", "name", "unit", "description"), STRANGERS)
def test_what_is_something_else_is_not_taken_for_it(
    quantity: Quantity, name: str, unit: str | None, description: str
) -> None:
    """A few look so much like it that they may be offered, but never as sure."""
    found = guess(quantity, [signal(name, unit, description)])
    assert found is None or ((quantity, name) in UNSURE and found.sureness != "sure")


@pytest.mark.parametrize("quantity", UNITS)
def test_a_truth_value_is_no_quantity(quantity: Quantity) -> None:
    """However it is named."""
    for name in sorted({word for words in WORDS.values() for word in words}):
        assert guess(quantity, [GuessedSignal(name, type="Boolean")]) is None


def test_the_best_comes_first_and_the_others_are_reported() -> None:
    signals = [
        signal("v2", "m/s"),
        signal("y", "m/s"),
        signal("speed", "m/s", "Speed of the train"),
        signal("v_soll", "m/s"),
    ]
    found = guess("speed", signals)
    assert found is not None
    assert (found.signal.name, found.sureness, found.others) == ("speed", "sure", ["v2", "y"])
    assert found.reason == "by its name, its unit m/s and its description"


def test_of_equals_the_first_is_taken_and_none_is_sure() -> None:
    found = guess("speed", [signal("speed_a", "m/s"), signal("speed_b", "m/s")])
    assert found is not None
    assert (found.signal.name, found.sureness) == ("speed_a", "likely")
    assert "as others are" in found.reason


def test_what_is_taken_is_not_taken_again() -> None:
    assert guess("speed", [signal("v", "m/s")], ["v"]) is None


def test_a_unit_nobody_understands_leaves_the_name() -> None:
    found = guess("speed", [GuessedSignal("speed", "furlong/fortnight")])
    assert found is not None
    assert not found.signal.readable
    assert found.sureness == "likely"


def test_among_equals_the_part_that_has_the_speed_comes_first() -> None:
    places = [signal("force.s", "m", "Distance"), signal("mass.s", "m", "Distance")]
    first, beside = guess("position", places), guess("position", places, part="mass")
    assert first is not None
    assert beside is not None
    assert (first.signal.name, beside.signal.name) == ("force.s", "mass.s")
    assert beside.sureness == first.sureness  # where a part helps to choose, it is no proof


def test_a_relative_distance_is_no_position() -> None:
    assert guess("position", [signal("spring.s_rel", "m", "Relative distance")]) is None
    assert guess("position", [signal("s_nominal", "m", "Nominal value")]) is None
