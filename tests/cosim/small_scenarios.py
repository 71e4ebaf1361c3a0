"""Scenarios small enough for a test: the shipped models as blocks (no compiler), one observer, half a second."""

from __future__ import annotations

from typing import Any

from cosim import Scenario


def small(**changes: Any) -> Scenario:
    """Locomotive, odometer, driver and one observer as blocks, three balises by position; `changes` are top-level
    keys.
    """
    scenario = Scenario(stop=0.5, step=0.01, **changes)
    scenario.add(
        "locomotive",
        model="locomotive",
        **{"as": "block3"},
        parameters={"train_speed": 10.0, "wheel_rate": 10.0 / 0.575},
    )
    scenario.add("odometer", model="odometer", **{"as": "block3"})
    scenario.add("driver", model="driver", **{"as": "block3"}, parameters={"profile_speed": 10.0})
    scenario.add("observer", observer="takagi_sugeno_cdo", **{"as": "block3"}, parameters={"estimated_speed": 10.0})
    scenario.connect(
        "driver.effort -> locomotive.effort, observer.effort",
        "locomotive.wheel_speed -> odometer.wheel_speed",
        "odometer.reading -> driver.odometer, observer.odometer",
    )
    scenario.balises(
        position="locomotive.position",
        speed="locomotive.speed",
        odometer="odometer.reading",
        layout="positions",
        positions=[1.0, 2.5, 4.0],
        method="rollback",
    )
    scenario.report(true_position="locomotive.position", true_speed="locomotive.speed", odometer="odometer.reading")
    return scenario
