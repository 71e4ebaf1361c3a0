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


@pytest.mark.parametrize("place", ["own_clone.egg-info/PKG-INFO", "own_clone-2.5.dist-info/METADATA"])
def test_a_clone_on_the_path_has_its_version_too(place: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / place
    file.parent.mkdir()
    file.write_text("Metadata-Version: 2.4\nName: own-clone\nVersion: 2.5\n\nText\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    assert installed_version("own-clone") == "2.5"
