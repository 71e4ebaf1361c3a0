"""Inputs without a connection: shipped scenarios are warned of none that is meant to be free, and of each forgotten."""

from __future__ import annotations

import pytest

from cosim import Scenario
from cosim.scenario.shipped import shipped_scenarios
from cosim.structure.run_structure import Structure

NAMES = sorted({*shipped_scenarios()} - {"own_fmu"})  # that one waits for a file of the user's

READ = ("odometer", "measured_speed", "speed", "generator_speed", "measured_y")


def _reported(structure: Structure) -> str:
    return "".join(text for text in structure.warnings if text.startswith("Unconnected inputs"))


@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_scenario_is_warned_of_forgotten_inputs_only(name: str) -> None:
    scenario = Scenario.load(name)
    shown = scenario.structure()
    assert not _reported(shown)
    read = [link for link in shown.links if link.target[1] in READ]
    assert read
    scenario._data["connections"] = [str(link) for link in shown.links if link not in read]
    reported = _reported(scenario.structure())
    assert [link for link in read if ".".join(link.target) not in reported] == []
