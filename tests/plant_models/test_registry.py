"""Registries find members without importing them; what installed packages and users bring is checked in words."""

from __future__ import annotations

import re
import subprocess
import sys
from abc import abstractmethod
from importlib.metadata import EntryPoint
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Literal

import pytest

import fmu_observer
import plant_models
from cosim.expectations.expectation import WindowExpectation
from cosim.expectations.registry import EXPECTATIONS
from cosim.report.figures.panels import FIGURES
from cosim.results.formats.known_formats import FORMATS
from cosim.scenario.model_name import EXPECTED
from cosim.scenario.scenario_tables import ComponentTable
from cosim.simulation.scenario import Scenario
from fmus.check.known_checks import CHECKS
from fmus.check.known_checks import EXPECTED as CHECK
from plant_models import registry
from plant_models.registry import Registry, RegistryError
from plant_models.user_file import UserFileError, load_class

ALL: tuple[Registry[Any], ...] = (
    plant_models.PLANTS,
    plant_models.FAULT_CAUSES,
    fmu_observer.OBSERVERS,
    FORMATS,
    FIGURES,
    EXPECTATIONS,
    CHECKS,
)


@pytest.mark.parametrize("members", ALL, ids=lambda r: r.kind)
def test_every_name_has_one_member_which_loads(members: Registry[Any]) -> None:
    assert len(members) > 4
    assert [name for name, found in members.members.items() if len(found) > 1] == []
    assert all(registry.descends_from(members[name], members.base) for name in members)


def test_listing_imports_no_member() -> None:
    code = (
        "import sys, plant_models, fmu_observer; "
        "assert 'takagi_sugeno_cdo' in fmu_observer.OBSERVERS and len(plant_models.PLANTS) > 10; "
        "assert not {'casadi', 'numpy', 'scipy'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def announced(name: str, value: str, package: str) -> Any:
    entry = SimpleNamespace(name=name, value=value, dist=SimpleNamespace(name=package, version="1.0"))
    return EntryPoint, entry


@pytest.fixture
def plugins(monkeypatch: pytest.MonkeyPatch) -> Registry[Any]:
    """A registry with what three installed packages announce."""
    entries = [
        announced("thau", "other.module:Thau", "clashing")[1],
        announced("mine", "fmu_observer.observers.generic.continuous.thau:Thau", "honest")[1],
        announced("gone", "no_such_module:Gone", "broken")[1],
        announced("wrong", "math:pi", "odd")[1],
    ]
    monkeypatch.setattr(registry, "announced", lambda group: entries if group == "some.group" else [])
    members: Registry[Any] = Registry("observer", fmu_observer.ROOMS, "some.group", plant_models.SYSTEM)
    monkeypatch.setattr(fmu_observer, "OBSERVERS", members)
    return members


def test_an_installed_package_brings_a_member(plugins: Registry[Any]) -> None:
    assert plugins["mine"].name == "thau"
    assert plugins.origin("mine").startswith("the package honest 1.0")
    assert plugins.room("mine") == ""


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("thau", "taken twice, by this package .* and the package clashing 1.0 .*; rename or uninstall one of them"),
        ("gone", "'gone' of the package broken 1.0 .* cannot be loaded: ModuleNotFoundError"),
        ("wrong", "'wrong' of the package odd 1.0 .* is no subclass of plant_models.hybrid.system.HybridSystem"),
    ],
)
def test_what_a_package_announces_wrongly_is_reported(plugins: Registry[Any], name: str, words: str) -> None:
    with pytest.raises(RegistryError, match=words):
        plugins[name]
    with pytest.raises(Exception, match=f"components.observer: .*{words}"):
        Scenario(stop=1.0, step=0.1).add("observer", observer=name).run()


def test_a_program_adds_and_takes_away() -> None:
    members: Registry[Any] = Registry("plant", plant_models.ROOMS, "none", plant_models.SYSTEM)
    members["own"] = plant_models.Train
    assert list(members)[-1] == "own"
    assert members.origin("own") == "registered by this program"
    del members["own"]
    with pytest.raises(KeyError):
        members["own"]


FAULTS = {
    "missing.py:Bias": (None, "missing.py does not exist; write path/to/file.py:Class"),
    "empty.py:Bias": ("x = 1\n", "no .*HybridSystem.* named 'Bias'; it has: none"),
    "raises.py:Bias": ("\n\n1 / 0\n", r"cannot be run: ZeroDivisionError: division by zero \(.*raises.py:3\)"),
    "syntax.py:Bias": ("class Bias(:\n", r"cannot be run: SyntaxError: .*syntax.py:1\)"),
    "leaves.py:Bias": ("import sys\nsys.exit('bye')\n", r"cannot be run: SystemExit: bye \(.*leaves.py:2\)"),
    "number.py:Bias": ("Bias = 3.0\n", r"named 'Bias' \(Bias is of type float\)"),
    "bare.py:Bias": ("class Bias:\n    pass\n", r"named 'Bias' \(Bias is a class without a base\)"),
    "no_base.py": ("class Bias:\n    name = 'bias'\n", r"dt\) \(Bias is a class without a base\)"),
    "other_base.py:Bias": ("class Bias(dict):\n    pass\n", r"named 'Bias' \(Bias is a class of base dict\)"),
    "misspelt.py:Bias": (
        "from plant_models.hybrid import HybridSystem\nclass Bias(HybridSytem):\n    name = 'bias'\n",
        r"NameError: name 'HybridSytem' is not defined; did you mean 'HybridSystem'\? \(.*misspelt.py:2\)",
    ),
    "two.py": (
        "class One:\n    step = print\nclass Two:\n    step = print\n",
        "it has: One, Two. Write [^ ]*two.py:Class",
    ),
    "no.such.module:Bias": (None, "no module named 'no'"),
    "math:Bias": (None, "module 'math' has no attribute 'Bias'"),
    "needs.py:Bias": (
        "class Bias:\n    def __init__(self, gain):\n        pass\n    def step(self, t, inputs, dt):\n        pass\n",
        "missing a required argument: 'gain'",
    ),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_users_file_that_is_wrong_is_reported_without_traceback(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from cosim.cli import main

    content, words = FAULTS[name]
    if content is not None:
        (tmp_path / name.partition(":")[0]).write_text(content)
    (tmp_path / "s.toml").write_text(f'stop = 1.0\nstep = 0.1\ncomponents.observer.observer = "{name}"\n')
    assert main(["run", str(tmp_path / "s.toml"), "--no-report", "--out", str(tmp_path / "out")]) != 0
    said = capsys.readouterr().err
    assert "Traceback" not in said
    assert "observer" in said
    with pytest.raises(AssertionError, match=words):
        raise AssertionError(said.replace("\n", " "))


def test_a_module_that_lies_here_and_is_not_searched_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A command does not search the folder that it is typed in, other than ``python`` does."""
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "filters.py").write_text("class Bias:\n    step = print\n")
    monkeypatch.chdir(tmp_path)
    words = "no module named 'mine'; mine/filters.py is here, but .* set PYTHONPATH=. or .* mine/filters.py:Bias"
    with pytest.raises(UserFileError, match=words):
        load_class("mine.filters:Bias", EXPECTED)


def test_a_missing_import_of_a_users_module_is_not_taken_for_a_missing_module(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "needs_more.py").write_text("import numppy\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(UserFileError, match=r"cannot be imported: ModuleNotFoundError: .*'numppy' \(.*needs_more.py:1"):
        load_class("needs_more:Bias", EXPECTED)


def test_a_changed_file_is_read_again(tmp_path: Path) -> None:
    file = tmp_path / "own.py"
    text = "class Own:\n    outputs = ['x']\n    x = {}\n    def step(self, t, inputs, dt):\n        pass\n"
    values = []
    for number in (1.0, 2.0):
        file.write_text(text.format(number))
        outcome = Scenario(folder=tmp_path, stop=1.0, step=0.5).add("own", model="own.py").run()
        values.append(outcome["own.x"][-1])
    assert values == [1.0, 2.0]


def test_names_remember_classes_through_copies_and_processes() -> None:
    import pickle

    table = ComponentTable.model_validate({"model": plant_models.Train})
    assert pickle.loads(pickle.dumps(table)).model.stated is plant_models.Train
    assert str(table.model) == "plant_models.railway.vehicle.train:Train"


def test_no_name_of_a_lazy_room_is_that_of_a_file_in_it() -> None:
    """Once the file is imported, ``room.name`` would be the module and not what it holds."""
    root = Path(plant_models.__file__).parents[1]
    rooms = [path.parent for path in root.glob("*/**/__init__.py") if "= lazy_names(" in path.read_text()]
    assert len(rooms) > 5
    clashes = [
        f"{path}:{name}"
        for room in rooms
        for path in room.glob("*.py")
        for name in re.findall(r"^(?:class |def )?(\w+)(?=.*[=(:])", path.read_text(), re.MULTILINE)
        if (room / f"{name}.py").exists()
    ]
    assert clashes == []


def test_an_expectation_may_be_registered_at_any_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(EXPECTATIONS, "_own", {})
    scenario = Scenario(stop=1.0, step=0.5).add("driver", model="driver")
    stated = {"check": "test_settles", "signal": "driver.effort", "within": 1e9}
    with pytest.raises(ValueError, match="expect, number 1: unknown check 'test_settles'"):
        scenario.set("expect", [stated])

    class SettlesExpectation(WindowExpectation):
        check: Literal["test_settles"] = "test_settles"
        signal: str
        within: float

        def evaluate(self, run: Any) -> list[Any]:
            return []

    EXPECTATIONS["test_settles"] = SettlesExpectation
    (found,) = scenario.set("expect", [stated]).table().expect
    assert isinstance(found, SettlesExpectation)
    with pytest.raises(ValueError, match="expect, number 1, 'test_settles', within: "):
        scenario.set("expect", [stated | {"within": "x"}]).table()


def test_a_member_that_is_left_out_is_reported_once(plugins: Registry[Any], caplog: pytest.LogCaptureFixture) -> None:
    registry.log_left_out.cache_clear()
    for _ in range(2):
        assert "mine" in plugins.usable()
    said = [record.getMessage() for record in caplog.records]
    assert [text.split()[0] for text in said] == ["'thau'", "'gone'", "'wrong'"]
    with pytest.raises(RegistryError, match="the observer 'number' is no subclass of"):
        plugins["number"] = 3


ROOM = '''
from abc import ABC, abstractmethod
from {package}.base import Base as Root


class Middle(
    Root,
):
    """It has no name of its own."""


class Bare(Middle):
    name = "bare"


class Helper:
    name = "helper"


class Unfinished(Root):
    name = "unfinished"

    @abstractmethod
    def run(self):
        """Left out."""


class Root2(ABC):
    name = "no member"
'''


@pytest.fixture
def own_room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Registry[Any]:
    """A package with a base, and a room whose file has members and classes that are none."""
    package = f"package_of_{tmp_path.name}".replace("-", "_")
    room = tmp_path / package / "room"
    room.mkdir(parents=True)
    (room / "__init__.py").write_text("", encoding="utf-8")
    (room.parent / "__init__.py").write_text("", encoding="utf-8")
    (room.parent / "base.py").write_text("from abc import ABC\n\n\nclass Base(ABC):\n    pass\n", encoding="utf-8")
    (room / "things.py").write_text(ROOM.format(package=package), encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    return Registry("thing", [f"{package}.room"], "none", f"{package}.base:Base")


def test_a_member_is_a_subclass_of_the_base_whatever_else_has_a_name(own_room: Registry[Any]) -> None:
    assert list(own_room) == ["bare", "unfinished"]
    assert own_room["bare"].__name__ == "Bare"


MEANT = ':\n    name = "new"\n\n    def flow(self): ...\n'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("class New(Roott)", "name 'Roott' is not defined; did you mean 'Root'\\?"),
        ("class New", "its bases are none; write class New\\(Base\\)"),
        ("class New(ABC)", "its bases are ABC; write class New\\(Base\\)"),
    ],
)
def test_a_member_whose_base_is_misspelt_is_listed_and_its_look_up_says_so(
    own_room: Registry[Any], text: str, words: str
) -> None:
    (room,) = own_room.rooms
    folder = Path(next(iter(find_spec(room).submodule_search_locations)))  # type: ignore[union-attr,arg-type]
    (folder / "added.py").write_text(
        ROOM.format(package=room.split(".")[0]).split("class")[0] + text + MEANT, encoding="utf-8"
    )
    (folder.parent / "base.py").write_text("class Base:\n    def flow(self): ...\n", encoding="utf-8")
    registry._files_of.cache_clear()
    assert "new" in own_room
    with pytest.raises(RegistryError, match=f"the thing 'new' of this package .*{words}"):
        own_room["new"]


def test_a_member_that_is_not_complete_is_reported_with_what_it_lacks(own_room: Registry[Any]) -> None:
    words = r"the thing 'unfinished' of this package .* is not complete: Unfinished has no run\(\); write it"
    with pytest.raises(RegistryError, match=words):
        own_room["unfinished"]
    with pytest.raises(RegistryError, match="is not complete"):
        own_room["added"] = type(own_room["bare"])(
            "Added", (own_room["bare"],), {"run": abstractmethod(lambda _self: None)}
        )
    left_out: dict[str, str] = {}
    assert list(own_room.usable(left_out.__setitem__)) == ["bare"]
    assert "is not complete" in left_out["unfinished"]


def test_a_check_of_a_user_without_run_is_not_blamed_on_the_fmu(tmp_path: Path) -> None:
    path = tmp_path / "mine.py"
    path.write_text("from fmus.check.check import Check\nclass Mine(Check):\n    name = 'mine'\n", encoding="utf-8")
    with pytest.raises(UserFileError, match=r"mine.py:Mine is not complete: it has no run\(\); write it"):
        load_class(f"{path}:Mine", CHECK)
