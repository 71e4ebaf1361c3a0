"""Roles that a scenario does not name follow from its balises and connections."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np
import pytest
from small_scenarios import small

from cosim import Scenario
from cosim.report.page.run_statements import run_statements
from cosim.report.page.run_verdict import observer_statuses
from cosim.run.signal_roles import ROLES
from cosim.studies.measures import error_measures

ALL = {
    "true_position": "locomotive.position",
    "true_speed": "locomotive.speed",
    "true_slip": "locomotive.slip",
    "true_adhesion_force": "locomotive.adhesion_force",
    "odometer": "odometer.reading",
    "speed_reference": "driver.speed_reference",
}


def silent(**changes: object) -> Scenario:
    """The small scenario without a report table."""
    scenario = small(**changes)
    del scenario._data["report"]
    return scenario


def test_all_roles_follow_from_balises_and_connections() -> None:
    scenario = silent()
    del scenario._data["balises"]["odometer"]
    outcome = scenario.run()
    assert {role: asdict(outcome.spec)[role] for role in ROLES} == {
        **ALL,
        "true_fault": None,
    }
    assert any("true_speed = locomotive.speed" in note for note in outcome.result.summary["notes"])


def test_what_is_named_stays() -> None:
    outcome = silent().report(true_speed="locomotive.wheel_speed").run()
    assert outcome.spec.true_speed == "locomotive.wheel_speed"
    assert outcome.spec.true_position == ALL["true_position"]


def test_measures_cards_and_expectations_need_no_report_table() -> None:
    outcome = silent(expect=[{"check": "speed_error", "max": 1.0}]).run()
    error = np.abs(outcome["observer.speed"] - outcome["locomotive.speed"]).max()
    assert error_measures(outcome)["observer.speed_error_max"] == pytest.approx(error, abs=1e-12)
    assert [evaluated.passed for evaluated in outcome.expectations] == [True]
    assert {"Largest speed error", "Largest position error"} <= {
        fact[0]
        for fact in run_statements(outcome.result, outcome.spec, observer_statuses(outcome.result, outcome.spec))
    }


def test_a_sweep_prints_its_measures() -> None:
    text = silent().vary({"observer.mass": [70e3, 90e3]}).run(workers=1).table()
    assert "observer.speed_error_max" in str(text)


def test_two_odometers_and_other_units_are_no_role() -> None:
    scenario = silent()
    scenario.add("second", model="odometer", **{"as": "block3"}).add(
        "other", observer="takagi_sugeno_cdo", **{"as": "block3"}
    )
    scenario.connect("locomotive.wheel_speed -> second.wheel_speed", "second.reading -> other.odometer")
    del scenario._data["balises"]["odometer"]
    assert scenario.run().spec.odometer is None


def test_without_balises_and_observers_nothing_is_said() -> None:
    scenario = Scenario(stop=0.1, step=0.01).add("train", model="locomotive", **{"as": "block3"})
    assert {role: value for role, value in asdict(scenario.run().spec).items() if role in ROLES and value} == {}
