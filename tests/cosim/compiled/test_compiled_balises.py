"""The compiled stepper and balises: tables and telegrams of the Python stepper, to the last bit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from compiled_runs import assert_equal, both, steps_compiled
from test_fmus.build import linear_fmu

from cosim import Scenario

OBSERVERS = ("differentiator_cdo", "takagi_sugeno_cdo", "multirate_cdo", "discrete_uio")
VARIANTS: dict[str, dict[str, Any]] = {
    "as shipped": {"stop": 90.0},
    "late, missed and false": {
        "balises.latency": 0.0731,
        "balises.latency_jitter": 0.04,
        "balises.missed_fraction": 0.2,
        "balises.false_telegrams": [{"time": 7.003, "offset": 3.0}, {"time": 12.0, "offset": -2.0}],
    },
    "on the track": {"balises.layout": "spacing", "balises.spacing": 17.3, "balises.track_end": 400.0},
    "close together": {"balises.layout": "positions", "balises.positions": [20.0, 20.05, 20.11, 21.0, 60.0]},
    "stale": {"balises.timing": "stale"},
    "thinned": {"master.record_every": 3, "stop": 10.0},
    "FMI 2": {f"{name}.as": "fmu2" for name in (*OBSERVERS, "locomotive", "driver")},
}


@pytest.mark.parametrize("variant", VARIANTS)
def test_the_default_scenario(variant: str) -> None:
    overrides = (
        {"certificates": "ignore", "stop": 30.0} | {f"{name}.as": "fmu3" for name in OBSERVERS} | VARIANTS[variant]
    )
    python, compiled = both(Scenario.load("freight_profile_d"), **overrides)
    assert python.failure is None
    assert len(python.result.events) > 4
    assert steps_compiled(compiled) > 0.85 * overrides["stop"] / 0.01  # most steps hold no balise
    assert_equal(python, compiled)


def test_a_plant_that_leaps_over_a_balise(tmp_path: Path) -> None:
    """Its speed output says that it stands: no step seems to be near a balise, and the crossing is found afterwards."""
    fmu = linear_fmu(
        tmp_path,
        "liar",
        [[0.0]],
        [[1.0]],
        [[1.0], [0.0]],
        [[0.0], [0.0]],
        version=3,
        inputs=["u"],
        outputs=["position", "speed"],
        u0=[20.0],
        units={"position": "m", "speed": "m/s"},
    )
    scenario = Scenario(folder=tmp_path, stop=20.0, step=0.1).add("plant", fmu=str(fmu))
    scenario.add("after", fmu=str(linear_fmu(tmp_path, "after", [[0.0]], [[1.0]], [[1.0]], [[0.0]], version=2)))
    scenario.connect("plant.position -> after.u1")
    scenario.balises(
        position="plant.position",
        speed="plant.speed",
        layout="positions",
        positions=[51.3, 101.0, 300.1],
        method="rollback",
        receivers=[],
    )
    python, compiled = both(scenario)
    assert len(python.result.events) == 3
    assert_equal(python, compiled)
    assert steps_compiled(compiled) >= 190


@pytest.mark.parametrize("method", ["interpolate", "predict"])
def test_other_ways_to_localise_stay_with_python(method: str) -> None:
    overrides = {"certificates": "ignore", "stop": 2.0, "balises.method": method} | {
        f"{name}.as": "fmu3" for name in OBSERVERS
    }
    stepper = (
        Scenario.load("freight_profile_d")
        .run(overrides=overrides, warn=lambda _: None)
        .result.summary["master"]["stepper"]
    )
    assert stepper["name"] == "python"
    assert method in stepper["reason"]


def test_calls_are_counted_as_in_python() -> None:
    counts = []
    for stepper in ("python", "compiled"):
        outcome = Scenario.load("freight_profile_d").set("stop", 5.0).master(stepper=stepper).run(warn=lambda _: None)
        assert outcome.failure is None
        counts.append([{k: v["calls"] for k, v in c["cost"].items()} for c in outcome.result.summary["components"]])
    assert counts[0] == counts[1]
    assert counts[0][0]["restore"] > counts[0][0]["save"] > 10
