"""Packages that are not installed are named with what needs them and the command that installs them."""

from __future__ import annotations

import copy
import sys
import tomllib
from pathlib import Path

import pytest

from plant_models.explained_error import explained
from plant_models.missing_package import (
    LazyPackage,
    MissingPackageError,
    installation,
    is_installed,
    missing_package,
    optional_package,
)

PROJECT = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text(encoding="utf-8"))["project"]


@pytest.mark.parametrize("requirement", [*PROJECT["dependencies"], *PROJECT["optional-dependencies"]["frames"]])
def test_the_command_names_the_versions_that_the_project_asks_for(requirement: str) -> None:
    name = requirement.partition(">")[0]
    assert installation(name) == f"pip install '{requirement}'"


def test_a_package_that_nobody_asked_for_is_installed_by_its_name() -> None:
    assert installation("no-such-package") == "pip install 'no-such-package'"


def test_what_needs_a_missing_package_is_said_with_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "clarabel", None)
    assert not is_installed("clarabel")
    with pytest.raises(MissingPackageError) as raised:
        optional_package("clarabel", "A certificate")
    says = "A certificate: the package clarabel is not installed; pip install 'clarabel>=0.11'"
    assert str(raised.value) == missing_package(raised.value) == explained(raised.value) == says


def test_an_import_in_the_code_of_this_project_is_explained_and_one_of_others_is_not() -> None:
    own = ModuleNotFoundError("No module named 'matplotlib.axes'", name="matplotlib.axes")
    assert missing_package(own) == "the package matplotlib is not installed; pip install 'matplotlib>=3.9'"
    assert missing_package(ModuleNotFoundError("No module named 'mine'", name="mine")) == ""
    assert missing_package(ValueError("matplotlib")) == ""


def test_a_package_that_is_there_and_cannot_be_loaded_says_why(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "broken_package.py").write_text("import lacks_this\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(MissingPackageError, match=r"Tables: the package broken_package cannot be loaded .*lacks_this"):
        optional_package("broken_package", "Tables")


def test_a_lazy_package_is_loaded_when_it_is_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "slow_package.py").write_text("value = 3\n")
    monkeypatch.syspath_prepend(tmp_path)
    lazy = LazyPackage("slow_package", "Something")
    copy.copy(lazy)
    assert "slow_package" not in sys.modules
    assert lazy.value == 3
    assert "slow_package" in sys.modules
    with pytest.raises(AttributeError):
        _ = lazy.other
    monkeypatch.delitem(sys.modules, "slow_package")
