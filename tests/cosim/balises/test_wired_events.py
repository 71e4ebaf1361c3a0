"""An event whose count is connected comes from its source, as in docs/guide/foreign_masters.md, in this master."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from small_scenarios import small

from cosim import Scenario
from cosim.errors import CosimError
from cosim.run.outcome import Outcome

FIELDS = ("count", "time", "position")
LAYOUT = {
    "position": "locomotive.position",
    "speed": "locomotive.speed",
    "layout": "positions",
    "positions": [1.0, 2.5, 4.0],
}
CAPACITY = 4


def wired(fields: tuple[str, ...] = FIELDS, **balises: Any) -> Scenario:
    """The small scenario with a balise reader, wired to the observer; told by the master as well where `balises` are
    given.
    """
    scenario = Scenario(stop=0.5, step=0.01)
    for name, part in small().table().components.items():
        table = part.model_dump(by_alias=True, exclude_unset=True)
        scenario.add(name, **(table | ({"as": "block2"} if name == "observer" else {})))
    scenario.add(
        "reader",
        model="balise_reader",
        **{"as": "block2"},
        options={"layout": "positions", "balise_capacity": CAPACITY},
        parameters={"positions": [*LAYOUT["positions"], 1e30]},
    )
    scenario.set("driver.odometer", 0.0).connect(
        "driver.effort -> locomotive.effort, observer.effort",
        "locomotive.wheel_speed -> odometer.wheel_speed",
        "odometer.reading -> observer.odometer",  # no loop, in which what is held would depend on the other connections
        "locomotive.position -> reader.position",
        "locomotive.speed -> reader.speed",
        *(f"reader.balise_{field} -> observer.balise_{field}" for field in fields),
    )
    return scenario.balises(**balises) if balises else scenario


def run(scenario: Scenario) -> Outcome:
    outcome = scenario.run(warn=lambda _text: None)
    assert outcome.failure is None
    return outcome


def test_the_wiring_that_other_masters_need_runs_here() -> None:
    ours, theirs = run(wired((), **LAYOUT, method="interpolate")), run(wired())
    assert theirs["reader.balise_count"][-1] == 3.0
    stamps = [event.stamp for event in ours.result.events]
    np.testing.assert_allclose(np.unique(theirs["reader.balise_time"])[1:], stamps, rtol=0.0, atol=1e-12)
    # A row of ours before and one after each crossing; the last of each instant is the one to compare.
    rows = np.searchsorted(np.asarray(ours["time"]), np.asarray(theirs["time"]) + 1e-6) - 1
    for name in ("position", "speed"):
        np.testing.assert_allclose(theirs[f"observer.{name}"], ours[f"observer.{name}"][rows], rtol=0.0, atol=1e-9)


def test_the_master_does_not_notify_a_second_time_what_is_wired() -> None:
    alone, both = run(wired()), run(wired(**LAYOUT, method="interpolate"))
    assert len(both.result.events) == 3
    assert not any("observer" in event.outcomes for event in both.result.events)
    for name in ("position", "speed"):
        assert both[f"observer.{name}"][-1] == pytest.approx(alone[f"observer.{name}"][-1], abs=1e-9)


@pytest.mark.parametrize("fields", [("position",), ("time", "position")])
def test_a_part_of_an_event_is_refused_without_its_count(fields: tuple[str, ...]) -> None:
    with pytest.raises(CosimError, match="belongs to an event, which the master notifies; connect its count too"):
        wired(fields).run()
