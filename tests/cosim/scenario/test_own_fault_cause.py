"""A fault cause of a user's own in a scenario: named by its file as an observer is, kept, run again, drawn."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from cosim import Scenario, studies
from cosim.errors import ScenarioError
from cosim.provenance.rerun import rerun
from plant_models import FAULT_CAUSES, registry
from plant_models.faults.causes.adhesion_faults import AdhesionFaults
from plant_models.registry import Registry

CAUSE = """
from plant_models.faults.fault_cause import Fault, FaultCause
from plant_models.hybrid import parameter


class Worn(FaultCause):
    name = "worn"
    description = "A worn wheel"
    ranges = (("wear", 0.01, 0.1),)
    parameters = (parameter("wear", "1", 0.2, "Share of the radius that is worn off", min=0.0, max=0.5),)

    def fault(self, t, x, u, p, passed, values):
        return Fault(p.wear / (1.0 - p.wear))
"""
SCENARIO = """
stop = 1.0
step = 0.1
[components.wheel]
model = "wheel_fault"
as = "block3"
options = { cause = "worn.py:Worn" }
parameters = { speed = 20.0, effort = 0.0 }
"""


@pytest.fixture
def written(tmp_path: Path) -> Path:
    (tmp_path / "worn.py").write_text(CAUSE, encoding="utf-8")
    (tmp_path / "scenario.toml").write_text(SCENARIO, encoding="utf-8")
    return tmp_path


@pytest.fixture(params=["block3", pytest.param("fmu3", marks=pytest.mark.compiler)])
def kind(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def speed(scenario: Scenario) -> float:
    return float(scenario.run(warn=lambda _text: None)["wheel.wheel_speed"][-1])


def test_a_scenario_names_its_file_and_an_edit_is_followed(written: Path, kind: str) -> None:
    (written / "scenario.toml").write_text(SCENARIO.replace("block3", kind), encoding="utf-8")
    assert speed(Scenario.load(written / "scenario.toml")) == pytest.approx(25.0)
    (written / "worn.py").write_text(CAUSE.replace("Fault(", "Fault(-"), encoding="utf-8")
    assert speed(Scenario.load(written / "scenario.toml")) == pytest.approx(15.0)


def test_results_keep_the_file_and_run_again_without_it(written: Path, tmp_path: Path) -> None:
    outcome = Scenario.load(written / "scenario.toml").run(warn=lambda _text: None)
    outcome.write(tmp_path / "results", report=False)
    (written / "worn.py").unlink()
    again = rerun(tmp_path / "results")
    assert again.verdict == "bit-identical"
    assert not again.changes  # the path is no part of the model
    assert (tmp_path / "results" / "made_from" / "files" / "wheel" / "worn.py").is_file()


def test_saved_elsewhere_and_set_from_the_working_folder_it_is_one_file(
    written: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = Scenario.load(written / "scenario.toml")
    (written / "elsewhere").mkdir()
    assert 'cause = "../worn.py:Worn"' in scenario.save(written / "elsewhere" / "saved.toml").read_text(
        encoding="utf-8"
    )
    monkeypatch.chdir(written)
    made = Scenario(stop=1.0, step=0.1, folder=written / "elsewhere")
    made.add("wheel", model="wheel_fault", parameters={"speed": 20.0, "effort": 0.0}, **{"as": "block3"})
    assert speed(made.set("wheel.options.cause", "worn.py:Worn")) == pytest.approx(25.0)
    assert speed(made.set("wheel.options", {"cause": "worn.py:Worn"})) == pytest.approx(25.0)


def test_studies_draw_from_the_ranges_of_the_causes(written: Path) -> None:
    scenario = Scenario.load(written / "scenario.toml")
    scenario.add("signal", model="signal_fault", options={"fault_count": 2}, **{"as": "block3"})
    ranges = studies.fault_ranges(scenario)
    assert sorted(ranges) == ["signal.fault_gain[1]", "signal.fault_gain[2]", "wheel.wear"]
    result = scenario.vary(ranges, mode="latin", count=3).run(
        measure={"speed": lambda outcome: outcome["wheel.wheel_speed"][-1]}
    )
    speeds = [run.measures["speed"] for run in result.runs]
    assert len(set(speeds)) == 3
    assert all(20.0 / 0.99 <= found <= 20.0 / 0.9 for found in speeds)


@pytest.mark.parametrize(
    ("cause", "words"),
    [
        (
            "worn.py:Wron",
            r"components.wheel: wheel_fault: .*worn.py has no subclass of FaultCause named 'Wron'; it has: W",
        ),
        ("gone.py:Worn", r"components.wheel: wheel_fault: .*gone.py does not exist; write path/to/file.py:Class"),
        ("wron", r"option cause = 'wron' of wheel_fault; choose from 'adhesion', .*, or write file.py:Class"),
    ],
)
def test_what_is_no_cause_is_refused_in_words(written: Path, cause: str, words: str) -> None:
    scenario = Scenario.load(written / "scenario.toml")
    with pytest.raises(ScenarioError, match=words):
        scenario.set("wheel.options.cause", str(written / cause) if ".py" in cause else cause).run()


def test_an_installed_package_brings_a_cause_and_one_of_a_shipped_name_is_refused(
    written: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = f"{AdhesionFaults.__module__}:AdhesionFaults"
    brings: list[Any] = [
        SimpleNamespace(name=name, value=target, dist=SimpleNamespace(name="other", version="1.0"))
        for name in ("theirs", "stated")
    ]
    monkeypatch.setattr(registry, "announced", lambda group: brings if group == FAULT_CAUSES.group else [])
    fresh: Registry[Any] = Registry(FAULT_CAUSES.kind, FAULT_CAUSES.rooms, FAULT_CAUSES.group, FAULT_CAUSES.base)
    monkeypatch.setattr(FAULT_CAUSES, "_members", fresh.members)
    scenario = Scenario.load(written / "scenario.toml")
    assert speed(scenario.copy().set("wheel.options", {"cause": "theirs"})) == 20.0
    with pytest.raises(
        ScenarioError, match=r"fault cause name 'stated' is taken twice, by this .* the package other 1.0"
    ):
        scenario.set("wheel.options", {"cause": "stated"}).run()
