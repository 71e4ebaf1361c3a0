"""FMU files that are missing, broken, foreign or dangerous: refused with the reason, and nothing is left behind."""

from __future__ import annotations

import os
import re
import tempfile
import zipfile
from pathlib import Path
from typing import Any

import fmpy
import pytest
from coupled_runs import Pushed

from cosim.cli import main as cosim_main
from cosim.components import unpacking
from cosim.components.description import read_description
from cosim.components.loading import load_fmu
from cosim.components.unpacking import _forget_all
from cosim.errors import FmuLoadError
from cosim.starter.inspected_fmu import inspect_fmu
from fmus.cli import main as fmus_main
from fmus.fmu_report import describe_file


def xml(version: str = "3.0", interface: str = '<CoSimulation modelIdentifier="toy"/>') -> str:
    token = "instantiationToken" if version.startswith("3") else "guid"
    old = ' modelIdentifier="toy" numberOfContinuousStates="0"' if version.startswith("1") else ""
    return (
        f'<?xml version="1.0"?><fmiModelDescription fmiVersion="{version}" modelName="toy" {token}="t"{old}>{interface}'
        "<ModelVariables/><ModelStructure/></fmiModelDescription>"
    )


def zipped(folder: Path, files: dict[str, str | bytes]) -> Path:
    path = folder / "toy.fmu"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return path


def library(version: str = "3.0") -> str:
    platform = fmpy.platform_tuple if version.startswith("3") else fmpy.platform
    return f"binaries/{platform}/toy{fmpy.sharedLibraryExtension}"


@pytest.fixture(autouse=True)
def _nothing_is_left_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(scratch))
    here = Path.cwd()
    yield
    _forget_all()  # as at the end of a process
    assert list(scratch.iterdir()) == []
    assert Path.cwd() == here


def refused(path: Path, match: str) -> None:
    with pytest.raises(FmuLoadError, match=match):
        load_fmu(path, "toy")


def test_missing_files_and_folders(tmp_path: Path) -> None:
    refused(tmp_path / "none.fmu", r"toy: FMU .*none.fmu does not exist")
    refused(tmp_path, r"is a folder; expected an .fmu file")


def test_what_is_no_archive(tmp_path: Path) -> None:
    path = tmp_path / "toy.fmu"
    path.write_text("hello")
    refused(path, "is not a readable FMU: .*zip")
    whole = zipped(tmp_path, {"modelDescription.xml": xml(), library(): b"x" * 5000})
    path.write_bytes(whole.read_bytes()[:-200])
    refused(path, "is not a readable FMU")


@pytest.mark.parametrize(
    ("files", "match"),
    [
        ({"readme.txt": "no description"}, "is not a readable FMU"),
        ({"modelDescription.xml": "<fmiModelDescription"}, "is not a readable FMU"),
        (
            {"modelDescription.xml": xml(interface='<ScheduledExecution modelIdentifier="toy"/>')},
            "offers scheduled execution only; co-simulation or model exchange is asked for",
        ),
        (
            {"modelDescription.xml": xml(interface='<ModelExchange modelIdentifier="toy"/>')},
            "no library for this platform",
        ),
        ({"modelDescription.xml": xml("1.0")}, f"no library .*{fmpy.platform} is needed"),
        ({"modelDescription.xml": xml("1.0", "<Implementation/>")}, f"no library .*{fmpy.platform} is needed"),
        (
            {"modelDescription.xml": xml("1.0", "<Implementation/>"), library("1.0"): b"x"},
            "cannot load .*Failed to load",
        ),
        ({"modelDescription.xml": xml("4.0")}, "Unsupported FMI version: 4.0"),
        ({"modelDescription.xml": xml()}, f"no library for this platform .*{fmpy.platform_tuple}.* it offers: none"),
        ({"modelDescription.xml": xml(), "binaries/riscv-vms/toy.so": b""}, "no library for this platform"),
        ({"modelDescription.xml": xml("2.0"), "binaries/vms/toy.so": b""}, "no library for this platform"),
        ({"modelDescription.xml": xml(), library(): b"not a library"}, "cannot load .*Failed to load shared library"),
        (
            {"modelDescription.xml": xml("2.0"), library("2.0"): b"not a library"},
            "cannot load .*Failed to load shared library",
        ),
    ],
)
def test_archives_that_are_no_usable_fmu(tmp_path: Path, files: dict[str, str | bytes], match: str) -> None:
    refused(zipped(tmp_path, files), match)


@pytest.mark.parametrize("version", ["1.0", "2.0", "3.0"])
def test_a_library_under_another_name_is_named(tmp_path: Path, version: str, capfd: pytest.CaptureFixture[str]) -> None:
    """Which file is there and which one is wanted; nobody says that such an FMU runs here."""
    there, wanted = library(version).replace("toy", "Toy_1"), library(version)
    described = xml(version, "<Implementation/>") if version == "1.0" else xml(version)
    path = zipped(tmp_path, {"modelDescription.xml": described, there: b"x"})
    words = rf"under another name than its model identifier: it holds {there} where {wanted} is wanted"
    refused(path, words)
    assert cosim_main(["info", str(path)]) == 0
    assert re.search(rf"runs here +no, .*{words}", capfd.readouterr().out)
    assert inspect_fmu(path).runs_here != "yes"
    if version == "1.0":
        return
    assert re.search(rf"this machine .*: no, .*{words}", "\n".join(f"{k}: {v}" for k, v in describe_file(path).items()))
    assert fmus_main(["check", str(path)]) == 2
    assert re.search(words, capfd.readouterr().err)


def test_an_archive_that_unpacks_to_too_much_is_not_unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A megabyte of zeros takes a kilobyte; the limit is lowered so that the test need not write gigabytes."""
    path = zipped(tmp_path, {"modelDescription.xml": xml(), library(): b"", "resources/zeros": b"\0" * 1_000_000})
    assert path.stat().st_size < 5000
    monkeypatch.setattr(unpacking, "MAX_UNPACKED_BYTES", 900_000)
    monkeypatch.setattr("cosim.components.loading.unpack", lambda *_: pytest.fail("it was unpacked"))
    refused(path, r"would unpack to 0.0 GB; refused")


def test_the_limit_leaves_room_for_honest_fmus() -> None:
    assert unpacking.MAX_UNPACKED_BYTES >= 1024**3


def test_the_name_may_be_anything(tmp_path: Path) -> None:
    with pytest.raises(FmuLoadError, match=r"a/b: .*Failed to load shared library"):
        load_fmu(zipped(tmp_path, {"modelDescription.xml": xml(), library(): b"not a library"}), "a/b")


@pytest.mark.compiler
@pytest.mark.parametrize("version", [2, 3])
def test_a_real_fmu_is_loaded_and_put_away(version: Any) -> None:
    import fmus

    path = fmus.cached_fmu(Pushed(), fmi_version=version)
    assert read_description(path).modelName == "pushed"
    never, used = load_fmu(path, "never"), load_fmu(path, "used")
    used.instantiate()
    assert len(os.listdir(tempfile.gettempdir())) == 3  # noqa: PTH208 - the content, and a folder of each instance
    for made in (never, used):
        made.terminate()
        made.free()
