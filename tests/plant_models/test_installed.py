"""Versions of installed packages, as wheels and as clones that stand on the path keep them."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path

import pytest

from plant_models.installed import installed_version


def test_versions_are_those_of_the_standard_library() -> None:
    for package in ("numpy", "scipy", "fmpy", "fmu-observer"):
        assert installed_version(package) == version(package)
    assert installed_version("no-such-package") is None


@pytest.mark.parametrize("place", ["clone_on_path.egg-info/PKG-INFO", "wheel_on_path-2.5.dist-info/METADATA"])
def test_a_clone_on_the_path_has_its_version_too(place: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / place
    file.parent.mkdir()
    name = f"{place.partition('_')[0]}-on-path"
    file.write_text(f"Metadata-Version: 2.4\nName: {name}\nVersion: 2.5\n\nText\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    assert installed_version(name) == "2.5"
