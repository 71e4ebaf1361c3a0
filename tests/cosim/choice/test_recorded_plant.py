"""A recorded run beside a scenario: whether its plant is the one of the scenario, from what the results say."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from small_scenarios import small

from cosim.results.result import Result
from cosim.run.recorded_plant import other_plant
from cosim.simulation.scenario import Scenario

PLANT = ("locomotive", "driver", "odometer")


def said(recorded: Result, scenario: Scenario) -> str:
    return other_plant(recorded, scenario.table(), scenario.folder, PLANT)


@pytest.fixture(scope="module")
def recorded() -> Result:
    return small().run(warn=lambda _: None).result


def changed(recorded: Result, **entries: Any) -> Result:
    """The run, whose locomotive was something else."""
    components = [c | entries if c["name"] == "locomotive" else c for c in recorded.summary["components"]]
    return replace(recorded, summary=recorded.summary | {"components": components})


def test_a_run_of_the_scenario_is_one_of_it_whatever_its_seed(recorded: Result) -> None:
    assert said(recorded, small()) == ""
    assert said(recorded, small().set("seed", 7)) == ""
    assert said(replace(recorded, summary={}), small()) == ""  # a table says nothing of what it is of


def test_what_was_another_is_named(recorded: Result) -> None:
    assert "locomotive was back (GUID {b}) and is" in said(changed(recorded, model="back", guid="{b}"), small())
    assert "locomotive had the preset 'worn' and has" in said(changed(recorded, preset="worn"), small())
    assert "locomotive did not run in it" in said(changed(recorded, name="train"), small())
    assert "locomotive.mass was" in said(recorded, small().set("locomotive.mass", 123e3))
