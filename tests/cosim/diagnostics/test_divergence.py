"""A run that blows up is blamed on the signal that left its range first, not on the one that overflows at last."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import plant_models
from cosim import Scenario
from cosim.structure.divergence import _for_good
from plant_models.hybrid import HybridSystem, input_signal, output_signal, parameter, state


class Runaway(HybridSystem):
    """``dv = growth v + push``: from 1 mm/s it is beyond 1000 m/s after ``ln(1e6) / growth``."""

    name = "runaway"
    states = (state("v", "m/s", 1e-3),)
    inputs = (input_signal("effort", "N"),)
    outputs = (output_signal("speed", "m/s"),)
    parameters = (parameter("growth", "1/s", 1.0),)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"v": p.growth * x.v + 1e-9 * u.effort}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"speed": x.v}


class Ranged(Runaway):
    """The same, that says within which range it belongs."""

    name = "ranged"
    outputs = (replace(output_signal("speed", "m/s"), min=-100.0, max=100.0),)


class Limited(HybridSystem):
    """A driver whose effort stays within 100 N, until a power in it overflows."""

    name = "limited"
    inputs = (input_signal("odometer", "m/s"),)
    outputs = (output_signal("effort", "N"), replace(output_signal("demand", "1"), min=0.0, max=1.0))
    parameters: ClassVar[Any] = (parameter("power", "1", 30.0),)

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        effort = 100.0 * np.tanh(u.odometer)
        return {
            "effort": effort + 1e-305 * np.exp(p.power * np.log(np.abs(u.odometer) + 1.0)),
            "demand": 0.01 * effort + 0.5,
        }


@pytest.fixture
def models(monkeypatch: pytest.MonkeyPatch) -> None:
    for system in (Runaway, Ranged, Limited):
        monkeypatch.setitem(plant_models.PLANTS, system.name, system)


def coupled(plant: str = "runaway", **changes: Any) -> Scenario:
    """The driver is listed first, so it is the first that is looked at."""
    scenario = Scenario(stop=60.0, step=0.1, **changes)
    scenario.add("driver", model="limited", **{"as": "block3"}).add("train", model=plant, **{"as": "block3"})
    return scenario.connect("driver.effort -> train.effort", "train.speed -> driver.odometer")


@pytest.mark.usefixtures("models")
@pytest.mark.parametrize(
    ("plant", "why", "when"),
    [
        ("runaway", "grew beyond anything plausible (1000)", np.log(1e6)),
        ("ranged", "left its declared range (-100 to 100)", np.log(1e5)),
    ],
)
def test_the_plant_is_blamed_and_not_the_driver_that_overflows_later(plant: str, why: str, when: float) -> None:
    outcome = coupled(plant).run()
    first, _, end = (outcome.failure or "").partition(" In the end: ")
    assert first.startswith(f"train.speed {why} first, at t = ")
    assert abs(float(first.partition("at t = ")[2].partition(" s")[0]) - when) < 0.2
    assert "'train' was fed by driver.effort -> effort (100)" in first
    assert end.startswith("Component 'driver' at t = ")
    assert float(end.partition("at t = ")[2].partition(" s")[0]) - when > 8.0  # the overflow comes much later


@pytest.mark.usefixtures("models")
def test_who_is_fed_by_nobody_went_by_itself() -> None:
    scenario = Scenario(stop=60.0, step=0.1).add(
        "train", model="runaway", **{"as": "block3"}, parameters={"growth": 30.0}
    )
    assert "Nothing is connected to 'train', so it went by itself." in (scenario.run().failure or "")


@pytest.mark.usefixtures("models")
def test_a_stable_pair_ends_without_a_word() -> None:
    assert coupled().set("train.growth", -1.0).set("stop", 5.0).run().failure is None


@given(st.lists(st.booleans(), max_size=40))
def test_it_is_the_first_row_outside_with_most_behind_it(outside: list[bool]) -> None:
    plain = [i for i, o in enumerate(outside) if o and np.mean(outside[i:]) >= 0.5]
    assert _for_good(np.array(outside, dtype=bool)) == (plain[0] if plain and any(outside[-3:]) else None)


def test_an_excursion_that_ended_is_none() -> None:
    calm, out = np.zeros(10, dtype=bool), np.ones(10, dtype=bool)
    assert _for_good(np.concatenate([out, calm])) is None
    assert _for_good(np.concatenate([out[:2], calm, out[:8]])) in (0, 12)
    assert _for_good(np.concatenate([calm, out])) == 10
