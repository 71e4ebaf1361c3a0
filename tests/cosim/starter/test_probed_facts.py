"""Which inputs a probe run tries as the effort of a train."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from cosim.starter.guessed_signal import GuessedSignal
from cosim.starter.probed_facts import probe
from plant_models.hybrid.units import UnitError, parse_unit


def _input(unit: str | None, name: str = "u", text: str = "") -> GuessedSignal:
    try:
        meaning = None if unit is None else parse_unit(unit)
    except UnitError:
        meaning = None
    return GuessedSignal(name, unit, meaning, text)


def _tried(signal: GuessedSignal) -> list[str]:
    """Inputs that a probe steps, of an FMU with this one."""
    asked: list[str] = []

    def respond(name: str, _parameters: Any) -> None:
        asked.append(name)

    inspected: Any = SimpleNamespace(inputs=[signal], outputs=[], hidden=[])
    run: Any = SimpleNamespace(respond=respond)
    roles: Any = SimpleNamespace(effort=None)
    assert not probe(inspected, roles, run).facts
    return asked


@pytest.mark.parametrize(
    ("unit", "tried"),
    [(None, True), ("kN", True), ("%", True), ("notch", True), ("kg/s", False), ("degC", False), ("Pa", False)],
)
def test_what_is_measured_in_something_else_than_a_force_is_no_effort(unit: str | None, tried: bool) -> None:
    assert _tried(_input(unit)) == ["u"] * tried


@pytest.mark.parametrize(
    ("name", "text", "tried"),
    [
        ("Pamb", "", False),
        ("p_amb", "", False),
        ("y3", "Ambient pressure", False),
        ("windSpeed", "", False),
        ("F_soll", "", True),
        ("u1", "Traction demand, less the slope", True),
        ("pedal", "", True),
    ],
)
def test_what_is_around_a_train_is_no_effort(name: str, text: str, tried: bool) -> None:
    assert _tried(_input(None, name, text)) == [name] * tried
