"""`cosim list`, `info`, `new` and `export` take what installed packages, programs and users bring, and tell what is
wrong with it in one line.
"""

from __future__ import annotations

import json
import tomllib
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

import plant_models
from cosim.cli import main
from cosim.simulation.scenario import Scenario
from cosim.starter.starter_file import StarterWishes, write_starter
from fmu_observer import OBSERVERS
from fmus import cached_fmu
from fmus.cli import main as fmus
from fmus.recipes import recipe
from plant_models import PLANTS, registry

FILTER = '''
class BiasFilter:
    """Learns nothing."""

    inputs = {"odometer": "m/s", "effort": "N"}
    outputs = {"speed": "m/s"}

    def __init__(self, gain=0.2):
        self.speed = gain

    def step(self, t, inputs, dt):
        self.speed = inputs.odometer
'''

TROLLEY = """
from plant_models.railway.vehicle.train import Train


class Trolley(Train):
    name = "trolley"
    description = "A train that is called otherwise"
"""


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> None:
    """What installed packages announce: one member that works, and four that are wrong."""
    entries = {
        "good": "plant_models.railway.vehicle.locomotive:Locomotive",
        "gone": "no_such_module:Gone",
        "wrong": "math:pi",
        "train": "other:Train",
        "shape": "plant_models.hybrid.system:HybridSystem",
    }
    group = PLANTS.group
    found = [EntryPoint(name, value, group) for name, value in entries.items()]
    monkeypatch.setattr(registry, "announced", lambda group: found if group == PLANTS.group else [])
    monkeypatch.setattr(PLANTS, "_members", None)
    monkeypatch.setattr(PLANTS, "_own", {"own": plant_models.Train})


@pytest.mark.usefixtures("installed")
def test_lists_show_origins_and_what_cannot_be_used(capsys: pytest.CaptureFixture[str]) -> None:
    for command, words in ((main, ["list", "--all"]), (fmus, ["list"])):
        assert command(words) == 0
        said = capsys.readouterr().out
        shown, _, unusable = said.partition("# Cannot be used")
        assert "# An installed package (plant_models.railway.vehicle.locomotive:Locomotive)\n" in shown
        assert "# Registered by this program\n" in shown
        lines = [line.split(maxsplit=1) for line in unusable.partition("observers:")[0].splitlines()]
        reasons = {line[0]: line[1] for line in lines if len(line) == 2}
        assert "the plant name 'train' is taken twice, by this package (plant_models" in reasons["train"]
        assert "cannot be loaded: ModuleNotFoundError: No module named 'no_such_module'" in reasons["gone"]
        assert "is no subclass of plant_models.hybrid.system.HybridSystem" in reasons["wrong"]
        assert "an installed package (plant_models.hybrid.system:HybridSystem): " in reasons["shape"]
    main(["list", "--json"])
    assert json.loads(capsys.readouterr().out)["models"]["good"]["room"].startswith("An installed package (")


def test_a_wrong_member_spoils_no_later_list(
    request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    request.getfixturevalue("installed")
    main(["list", "models"])
    monkeypatch.undo()
    capsys.readouterr()
    main(["list", "models", "--json"])
    assert json.loads(capsys.readouterr().out)["models"]["train"]["source"].startswith("Bouchama")


def test_info_describes_models_by_every_kind_of_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "own.py").write_text(FILTER)
    for name, words in {
        "locomotive": "Single-mass train",
        "discrete_uio": "events       balise",
        "plant_models.railway.vehicle.train:Train": "Multi-vehicle train",
        f"{tmp_path}/own.py:BiasFilter": "Learns nothing.",
    }.items():
        assert main(["info", name]) == 0
        assert words in capsys.readouterr().out
    main(["info", f"{tmp_path}/own.py", "--json"])
    found = {v["name"]: (v["causality"], v["start"]) for v in json.loads(capsys.readouterr().out)["variables"]}
    assert found["gain"] == ("parameter", 0.2)
    for name, words in {
        "takagi": "no model or observer 'takagi'; did you mean",
        f"{tmp_path}/none.py:X": "none.py does not exist",
        "C:/missing.fmu": "does not exist",
    }.items():
        assert main(["info", name]) == 2
        assert words in capsys.readouterr().err


@pytest.mark.usefixtures("installed")
def test_a_starter_takes_an_observer_of_the_users(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(OBSERVERS, "_members", {**OBSERVERS.members, "gone": [PLANTS.members["gone"][0]]})
    (tmp_path / "own.py").write_text(FILTER)
    fmu = cached_fmu(recipe("locomotive"))
    made = write_starter(fmu, tmp_path / "to" / "s.toml", StarterWishes(f"{tmp_path}/own.py:BiasFilter"))
    assert tomllib.loads(made.text)["components"]["observer"]["observer"] == "../own.py:BiasFilter"
    assert Scenario.load(tmp_path / "to" / "s.toml").set("stop", 0.5).run().failure is None
    with pytest.raises(ValueError, match="No observer 'nobody' that listens"):
        write_starter(fmu, tmp_path / "t.toml", StarterWishes("nobody"))
    with pytest.raises(ValueError, match=r"'gone' of an installed package .* cannot be loaded"):
        write_starter(fmu, tmp_path / "t.toml", StarterWishes("gone"))


def test_a_plant_of_the_users_goes_into_a_package_and_back(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(TROLLEY)
    scenario = Scenario(folder=tmp_path, stop=0.2, step=0.1).add("plant", model="own.py:Trolley")
    package = scenario.export_ssp(tmp_path / "elsewhere" / "p.ssp")
    (tmp_path / "own.py").unlink()
    again = Scenario.load(package).run()
    assert again.failure is None
    assert "plant.speed" in again.result.table.dtype.names
