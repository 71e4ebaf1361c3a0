"""The shipped validation campaign: all its cases run as they say, and without jams nothing is taken for one."""

from __future__ import annotations

import pytest

from cosim import Scenario
from cosim.studies.groups import groups

pytestmark = pytest.mark.compiler
SPEEDS = {"HS": 45.0, "AS": 30.0, "LS": 17.0}


def test_every_case_accelerates_holds_and_brakes() -> None:
    scenario = Scenario.load("validation_campaign")
    assert len(scenario.cases) == 13
    for run in scenario.vary({"case": list(scenario.cases)}).run().runs:
        assert run.outcome is not None
        assert run.failure is None
        speed, target = run.outcome["train.speed"], SPEEDS[run.settings["case"][:2]]
        held = run.outcome.result.time[abs(speed - target) < 0.1]
        assert speed.max() == pytest.approx(target, rel=0.01)
        assert 30.0 < held[-1] - held[0] < 75.0  # about a minute; the pneumatic cases come nearer slowly
        assert 1.0 < speed[-1] < 4.0  # jams at a standstill could not be seen
        assert 3 < sum(event.kind == "true" for event in run.outcome.result.events) < 40


def test_without_jams_there_are_no_alarms_in_braking_or_before() -> None:
    scenario = Scenario.load("validation_campaign").set("wheel.jam_rate", 0.0)
    cases = list(scenario.cases)
    variations = {"case": cases, "wheel.jam_rate": [0.0], "report.evaluate_after": [6.0]}
    found = groups(scenario.vary(variations).run(keep=False), "case")
    alarms = {case: found[case]["quasi_lpv_uio.false_alarms"].mean for case in cases}
    assert alarms == dict.fromkeys(cases, 0.0)


def test_the_observer_knows_its_position_better_than_the_odometer_in_jams() -> None:
    """Over three drawings and the deepest jams: by half at least."""
    sweep = Scenario.load("validation_campaign").vary({"case": ["HS EBA", "AS EBA"], "wheel.seed": range(3)})
    for spreads in groups(sweep.run(keep=False), "case").values():
        ours, sensor = (spreads[f"{name}.balise_error_max"].mean for name in ("quasi_lpv_uio", "odometer_reset"))
        assert ours < 0.5 * sensor
        assert spreads["quasi_lpv_uio.missed_share"].mean < 0.15
