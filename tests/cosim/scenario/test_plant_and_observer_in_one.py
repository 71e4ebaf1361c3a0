"""An observer beside a plant is the same observer inside one system with that plant, to rounding."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fmu_observer
import plant_models
from cosim import Scenario
from fmu_observer.observers.train.takagi_sugeno_cdo import TakagiSugenoCdo
from plant_models.hybrid import HybridSystem, input_signal, output_signal, parameter, state

OBSERVER = TakagiSugenoCdo()


class Mass(HybridSystem):
    """``M dv = F - d v``, integrated as the observer is."""

    name = "mass"
    description = "A mass on a rail"
    source = "this test"
    states = (state("travelled", "m"), state("rolling", "m/s", 10.0))
    inputs = (input_signal("effort", "N"),)
    outputs = (output_signal("position", "m"), output_signal("speed", "m/s"))
    parameters = (parameter("weight", "kg", 80e3, min=1.0), parameter("drag", "N.s/m", 900.0, min=0.0))

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return {"travelled": x.rolling, "rolling": (u.effort - p.drag * x.rolling) / p.weight}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"position": x.travelled, "speed": x.rolling}


class Together(HybridSystem):
    """Both in one: the effort is one input."""

    name = "together"
    description = "A mass and its observer"
    source = "this test"
    states = (*Mass.states, *OBSERVER.states)
    inputs = OBSERVER.inputs
    outputs = (*Mass.outputs, output_signal("own_position", "m"), output_signal("own_speed", "m/s"))
    parameters = (*Mass.parameters, *OBSERVER.parameters)
    events = OBSERVER.events
    frictions = OBSERVER.frictions

    def __init__(self) -> None:
        self.presets = OBSERVER.presets
        self.default_preset = OBSERVER.default_preset
        super().__init__()

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return Mass.flow(self, t, x, u, p) | OBSERVER.flow(t, x, u, p)

    def friction(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return OBSERVER.friction(t, x, u, p)

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        own = OBSERVER.output(t, x, u, p)
        return Mass.output(self, t, x, u, p) | {"own_position": own["position"], "own_speed": own["speed"]}

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> Any:
        return OBSERVER.jump(event, t, x, u, p)


@pytest.mark.parametrize("algorithm", ["auto", "jacobi"])
def test_an_observer_fed_what_the_plant_was_fed_is_the_one_inside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, algorithm: str
) -> None:
    """A loop of driver, mass and observer; then mass and observer in one, beside what was recorded of the loop:
    1e-11.
    """
    monkeypatch.setitem(plant_models.PLANTS, "mass", Mass)
    monkeypatch.setitem(fmu_observer.OBSERVERS, "together", Together)
    block = {"as": "block3"}
    loop = Scenario(stop=2.0, step=0.02, certificates="ignore", master={"algorithm": algorithm})
    loop.add("observer", observer="takagi_sugeno_cdo", parameters={"estimated_speed": 9.0}, **block)
    loop.add("driver", model="driver", parameters={"profile_speed": 14.0}, **block).add("train", model="mass", **block)
    loop.connect("driver.effort -> train.effort, observer.effort", "train.speed -> driver.odometer, observer.odometer")
    places = {"layout": "positions", "positions": [0.7, 4.0, 4.05, 13.0, 19.0]}
    loop.balises(position="train.position", speed="train.speed", odometer="train.speed", method="rollback", **places)
    beside = loop.run()
    assert beside.failure is None
    folder = tmp_path / "loop"
    beside.write(folder, report=False)

    one = Scenario(stop=2.0, step=0.02, certificates="ignore", master={"algorithm": algorithm})
    one.add("together", observer="together", parameters={"estimated_speed": 9.0}, **block)
    one.add("driver", recording=str(folder)).add("train", recording=str(folder))
    one.connect("driver.effort -> together.effort", "train.speed -> together.odometer")
    one.balises(layout="recorded", file=str(folder))
    inside = one.run()
    assert inside.failure is None
    assert len(inside.result.events) == len(beside.result.events) == 5
    assert np.ptp(beside["driver.effort"]) > 1e3
    for name, own in {
        "train.position": "position",
        "train.speed": "speed",
        "observer.position": "own_position",
        "observer.speed": "own_speed",
    }.items():
        np.testing.assert_allclose(inside[f"together.{own}"], beside[name], rtol=1e-11, atol=1e-11, err_msg=name)
