"""The told bound of a balise's instant holds what the plant's own solver adds; where nothing is known it is not a
number.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_fmus.adaptive import adaptive_fmu, crossings

from cosim import Scenario
from cosim.balises.plant_monitor import PlantError
from cosim.run.outcome import Outcome

STOP = 8.0
PLACES = (-0.5, 0.1, 0.6)
METHODS = ("auto", "rollback", "predict", "interpolate")

pytestmark = pytest.mark.compiler


def ran(fmu: Path, method: str, step: float = 0.1, **more: Any) -> Outcome:
    one = Scenario(stop=STOP, step=step).add("plant", fmu=str(fmu), **more)
    one.balises(
        layout="positions", positions=list(PLACES), position="plant.position", speed="plant.speed", method=method
    )
    outcome = one.run()
    assert outcome.failure is None
    return outcome


def off_and_stated(outcome: Outcome) -> tuple[np.ndarray, np.ndarray]:
    """True errors of the stamps and their told bounds [s]."""
    events = outcome.result.events
    true = np.sort(np.concatenate([crossings(place, STOP) for place in PLACES]))
    assert len(events) == len(true)
    return np.abs(np.array([e.stamp for e in events]) - true), np.array([e.time_bound for e in events])


@pytest.fixture(scope="module", params=[2, 3])
def fmu(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return adaptive_fmu(tmp_path_factory.mktemp("adaptive"), version=request.param)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("tolerance", [1e-3, 1e-4, 1e-6])
def test_a_plant_with_a_solver_is_off_by_less_than_stated(fmu: Path, tolerance: float, method: str) -> None:
    outcome = ran(fmu, method, tolerance=tolerance)
    off, reported = off_and_stated(outcome)
    assert np.all(off <= reported)
    # and it is no bound that says nothing
    assert np.median(reported) <= 200.0 * tolerance + 1e-2 * (method == "interpolate")
    probe = outcome.result.summary["probe"]
    assert probe["restores"] == "within_tolerance" or tolerance == 1e-3  # with which it takes whole steps
    if method == "auto" and tolerance < 1e-3:
        assert outcome.result.summary["localisation"]["method"] == "predict"


@pytest.mark.parametrize("version", [2, 3])
def test_a_forced_method_that_the_probe_knows_to_be_wrong_reports_unknown(tmp_path: Path, version: Any) -> None:
    outcome = ran(adaptive_fmu(tmp_path, version=version, forgets=True), "rollback")
    assert outcome.result.summary["probe"]["restores"] == "no"
    assert all(math.isnan(e.time_bound) for e in outcome.result.events)
    assert outcome.result.summary["localisation"]["bound"] == "unknown: the probe saw states that are not restored"
    assert any("How far the instants are off is unknown" in text for text in outcome.warnings)


def test_the_plants_error_is_a_distance_over_a_speed() -> None:
    assert PlantError().time(7.0, 3.0, 0.0) == 0.0
    assert PlantError(spread=1e-3).time(7.0, 3.0, -2.0) == pytest.approx(5e-4)
    assert PlantError(spread=1e-3, tolerance=1e-6).time(7.0, 100.0, 2.0) == pytest.approx(1e-3)
    assert PlantError(drift=1e-3, start=5.0).time(7.0, 100.0, 2.0) == pytest.approx(1e-3)
    assert math.isnan(PlantError(unknown="nobody knows").time(7.0, 1.0, 1.0))
    assert PlantError(unknown="nobody knows").words() == "unknown: nobody knows"
    assert "nothing that is known" in PlantError().words()
