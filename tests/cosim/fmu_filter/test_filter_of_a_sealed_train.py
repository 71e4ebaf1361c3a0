"""A filter over a sealed FMU whose units the scenario states is the filter over the FMU that declares them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_fmus.sealed_trains import GERMAN, TURNED, declaring

import cosim
import fmus
from plant_models.hybrid import HybridSystem
from plant_models.hybrid.units import parse_unit

pytestmark = [pytest.mark.compiler, pytest.mark.slow]

Units = Mapping[str, tuple[int, str]]
TRAINS: list[tuple[HybridSystem, Units]] = [
    (GERMAN, {"Fsoll": (1, "kN"), "sIst": (1, "m"), "vIst": (1, "km/h"), "zz1": (1, "m"), "zz2": (1, "m/s")}),
    (TURNED, {"AO_001": (-1, "N"), "AI_018": (1, "km"), "AI_017": (1, "m/s"), "zz1": (-1, "m"), "zz2": (-1, "m/s")}),
]
"""Sign and unit of effort, position, speed, and of both states."""


def outcome(fmu: Path, units: Units, stated: Mapping[str, Any]) -> cosim.Outcome:
    effort, position, speed, *_ = units
    scenario = cosim.Scenario(stop=20.0, step=0.1)
    scenario.add("driver", model="driver").add("odometer", model="odometer", parameters={"noise_std": 0.05})
    scenario.add("plant", fmu=fmu, units=stated)
    settings = {
        "kind": "ekf",
        "measurements": {speed: 0.1 / parse_unit(units[speed][1]).factor},
        "process_noise": {"zz2": 0.02},
        "start_deviation": {"zz1": 1.0, "zz2": 0.1},
        "balise": position,
    }
    scenario.add("filter", fmu=fmu, units=stated, filter=settings)
    scenario.connect(f"driver.effort -> plant.{effort}, filter.{effort}", f"plant.{speed} -> odometer.wheel_speed")
    scenario.connect(f"odometer.reading -> driver.odometer, filter.measured_{speed}")
    scenario.balises(position=f"plant.{position}", speed=f"plant.{speed}", layout="positions", positions=[30.0, 80.0])
    return scenario.run(warn=lambda _text: None)


@pytest.mark.parametrize(("system", "units"), TRAINS, ids=lambda what: getattr(what, "name", ""))
def test_stated_units_of_a_filter_are_declared_ones(system: HybridSystem, units: Units, tmp_path: Path) -> None:
    facts = {name: {"unit": unit, "sign": sign} for name, (sign, unit) in units.items()}
    stated = outcome(fmus.cached_fmu(system, fmi_version=2), units, facts)
    declared = outcome(declaring(system, units, tmp_path / "declared.fmu"), units, {})
    assert stated.failure is declared.failure is None
    for name in declared:
        np.testing.assert_array_equal(stated[name], declared[name], err_msg=name)
    _, position, speed, *_ = units
    assert stated[f"plant.{speed}"].max() > 10.0
    # of 0.1 m/s and of a balise known to 1 m, less in the mean of 20 s: these are right in SI, and in the usual sense
    assert abs(stated[f"filter.{speed}"] - stated[f"plant.{speed}"])[50:].max() < 0.1
    assert abs(stated[f"filter.{position}"] - stated[f"plant.{position}"])[50:].max() < 1.0
    assert {event.outcomes["filter"] for event in stated.result.events} == {"accepted"}
