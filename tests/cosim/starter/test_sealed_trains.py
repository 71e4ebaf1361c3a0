"""Trains as vendors seal them: no unit is declared, names say little, some numbers count the other way. What `cosim
new` writes is right without an answer.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_fmus.sealed_trains import CRYPTIC, GERMAN, TURNED, sealed

import fmus
from cosim import Scenario
from cosim.runs.executors import InThisProcess
from cosim.runs.job import Ended, Failure, Job
from cosim.starter import known_facts
from cosim.starter.starter_file import StarterWishes, write_starter

pytestmark = pytest.mark.compiler


SHOWN = {
    "zug": {"Fsoll": (1, "kN"), "sIst": (1, "m"), "vIst": (1, "km/h"), "vRad": (1, "km/h"), "m_ges": (1, "t")},
    "box": {"u1": (-1, "kN"), "y3": (1, "m"), "y1": (1, "km/h"), "y2": (1, "rad/s"), "p1": (1, "t")},
    "channels": {"AO_001": (-1, "N"), "AI_018": (1, "km"), "AI_017": (1, "m/s"), "K1": (1, "kg")},
}


@pytest.mark.parametrize("system", [GERMAN, CRYPTIC, TURNED], ids=lambda system: str(system.name))
def test_a_sealed_train_is_right_at_once(system: Any, tmp_path: Path) -> None:
    fmu = fmus.cached_fmu(system, fmi_version=2)
    write_starter(fmu, tmp_path / "mine.toml")
    units = tomllib.loads((tmp_path / "mine.toml").read_text())["components"]["plant"]["units"]
    assert {name: (fact.get("sign", 1), fact["unit"]) for name, fact in units.items()} == SHOWN[system.name]
    scenario = Scenario.load(tmp_path / "mine.toml").set("plant.record", ["zz1", "zz2"])
    outcome = scenario.run()
    forward = 1.0 if system is not TURNED else -1.0  # its own forward is what everybody else calls backward
    truth = forward * outcome["plant.zz2"]
    assert 13.0 < truth.max() < 14.5  # the driver's 50 km/h, in m/s
    assert abs(outcome["observer.speed"] - truth)[100:].max() < 0.1
    assert abs(outcome["observer.position"] - forward * outcome["plant.zz1"])[100:].max() < 0.5
    names: Mapping[str, str] = system.NAMES
    np.testing.assert_allclose(outcome[f"plant.{names['speed']}"], truth, atol=1e-9)


def test_a_mass_that_no_train_has_says_nothing_of_the_effort(tmp_path: Path) -> None:
    """A model per unit mass: 1 is neither kilograms nor tonnes."""
    scales = {"effort": 1.0, "position": 1.0, "speed": 1.0, "mass": 1.0}
    system = sealed("unit_mass", {"effort": "F", "position": "s", "speed": "v", "mass": "mass"}, scales, 1.0)
    made = write_starter(fmus.cached_fmu(system, fmi_version=2), tmp_path / "mine.toml")
    units = tomllib.loads(made.text)["components"]["plant"]["units"]
    assert units["v"]["unit"] == "m/s"
    assert "mass" not in units
    assert "unit" not in units["F"]


class _Fails(InThisProcess):
    def each(self, jobs: Iterable[Job]) -> Iterator[tuple[Job, Ended]]:
        return ((job, Ended(failure=Failure("plant: doStep at t = 0.5 s ended the process"))) for job in jobs)


def test_an_fmu_that_fails_in_the_probe_is_guessed_by_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(known_facts, "make_executor", lambda *_, **__: _Fails())
    made = write_starter(fmus.cached_fmu(GERMAN, fmi_version=2), tmp_path / "mine.toml")
    assert made.remarks[0].endswith("guessed by names alone: plant: doStep at t = 0.5 s ended the process")
    assert "units" not in tomllib.loads(made.text)["components"]["plant"]


def test_nothing_is_run_where_that_is_not_wanted(tmp_path: Path) -> None:
    fmu = fmus.cached_fmu(GERMAN, fmi_version=2)
    made = write_starter(
        fmu, tmp_path / "mine.toml", StarterWishes(probe=False, assumed=["vIst=km/h", "Fsoll=effort,-kN"])
    )
    assert "nothing of it was executed" in made.text
    units = tomllib.loads(made.text)["components"]["plant"]["units"]
    assert units == {"vIst": {"unit": "km/h"}, "Fsoll": {"unit": "kN", "sign": -1, "meaning": "effort"}}


def test_what_is_assumed_stands_above_what_a_run_shows(tmp_path: Path) -> None:
    fmu = fmus.cached_fmu(CRYPTIC, fmi_version=2)
    write_starter(fmu, tmp_path / "mine.toml", StarterWishes(assumed=["p1=kg"]))
    units = tomllib.loads((tmp_path / "mine.toml").read_text())["components"]["plant"]["units"]
    assert units["p1"]["unit"] == "kg"
