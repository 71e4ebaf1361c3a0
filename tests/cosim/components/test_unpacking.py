"""An FMU is unpacked once for its content; what an instance does to its files is its own affair."""

from __future__ import annotations

import os
import shutil
import tempfile
import zipfile
from pathlib import Path
from typing import Any

import pytest

from cosim.components import unpacking
from cosim.components.unpacking import read_archive, unpack
from fmus.fmi.archive import NotAnFmuError

LIBRARY = "binaries/x86_64-linux/gain.so"
CONTENT = {
    LIBRARY: "machine code",
    "resources/table.csv": "1,2",
    "sources/a.c": "int a;",
    "documentation/index.html": "",
}
DESCRIPTION = {
    3: '<fmiModelDescription fmiVersion="3.0" modelName="gain" instantiationToken="{1}"><CoSimulation '
    'modelIdentifier="gain"/><ModelVariables><Float64 name="time" valueReference="0" causality="independent"/>'
    "</ModelVariables><ModelStructure/></fmiModelDescription>",
    1: '<fmiModelDescription fmiVersion="1.0" modelName="gain" modelIdentifier="gain" guid="{1}" '
    'numberOfContinuousStates="0" numberOfEventIndicators="0"><ModelVariables/><Implementation>'
    "<CoSimulation_StandAlone><Capabilities/></CoSimulation_StandAlone></Implementation></fmiModelDescription>",
}


@pytest.fixture(autouse=True)
def _own_contents(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(unpacking, "_contents", type(unpacking._contents)())
    monkeypatch.setattr(tempfile, "tempdir", None)
    (tmp_path / "temporary").mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / "temporary"))


@pytest.fixture
def extractions(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """Where archives are unpacked to."""
    places: list[Path] = []
    usual = zipfile.ZipFile.extractall

    def noted(self: Any, path: Any, *more: Any) -> None:
        places.append(Path(path))
        usual(self, path, *more)

    monkeypatch.setattr(zipfile.ZipFile, "extractall", noted)
    return places


def make_fmu(path: Path, version: int = 3, **changed: str) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", DESCRIPTION[version])
        for name, text in (CONTENT | changed).items():
            archive.writestr(name, text)
    return path


def files_in(folder: Path) -> dict[str, str]:
    return {str(p.relative_to(folder)): p.read_text() for p in folder.rglob("*") if p.is_file()}


def temporary() -> list[Path]:
    return list(Path(os.environ["TMPDIR"]).iterdir())


def test_one_content_is_unpacked_once_and_copied(tmp_path: Path, extractions: list[Path]) -> None:
    first = make_fmu(tmp_path / "a.fmu")
    second = Path(shutil.copy(first, tmp_path / "b.fmu"))
    folders = [unpack(read_archive(path)) for path in (first, second, first)]
    assert len(extractions) == 1
    assert len({(folder / LIBRARY).stat().st_ino for folder in folders}) == len(set(folders)) == 3
    assert all(files_in(folder) == files_in(folders[0]) for folder in folders)
    assert set(files_in(folders[0])) == {LIBRARY, "resources/table.csv", "modelDescription.xml"}


def test_what_an_instance_does_to_its_files_is_its_own_affair(tmp_path: Path) -> None:
    path = make_fmu(tmp_path / "a.fmu")
    for _ in range(3):
        folder = unpack(read_archive(path))
        assert (folder / "resources" / "table.csv").read_text() == "1,2"
        (folder / "resources" / "table.csv").write_text("spoilt")
        (folder / LIBRARY).unlink()
        (folder / "resources" / "more.csv").write_text("3")


def test_a_file_that_changed_is_unpacked_anew(tmp_path: Path) -> None:
    for text in ("1,2", "3,4", "5,6"):
        folder = unpack(read_archive(make_fmu(tmp_path / "a.fmu", **{"resources/table.csv": text})))
        assert (folder / "resources" / "table.csv").read_text() == text


def test_files_that_somebody_tidied_up_are_unpacked_again(tmp_path: Path, extractions: list[Path]) -> None:
    path = make_fmu(tmp_path / "a.fmu")
    before = files_in(unpack(read_archive(path)))
    for folder in temporary():
        shutil.rmtree(folder)
    assert files_in(unpack(read_archive(path))) == before
    assert files_in(unpack(read_archive(path))) == before
    assert len(extractions) == 2


def test_an_fmu_of_version_1_gets_all_its_files(tmp_path: Path) -> None:
    assert set(files_in(unpack(read_archive(make_fmu(tmp_path / "a.fmu", 1))))) == {*CONTENT, "modelDescription.xml"}


def test_everybody_has_a_description_of_his_own(tmp_path: Path) -> None:
    path = make_fmu(tmp_path / "a.fmu")
    for _ in range(3):
        description = read_archive(path).description
        assert description.modelName == "gain"
        assert description.modelVariables[0].name == "time"
        description.modelName = description.modelVariables[0].name = "spoilt"


def test_a_copy_elsewhere_is_known_by_its_own_path(tmp_path: Path) -> None:
    first = make_fmu(tmp_path / "a.fmu")
    second = Path(shutil.copy(first, tmp_path / "b.fmu"))
    assert [read_archive(path).path for path in (first, second)] == [first, second]


def test_a_damaged_archive_leaves_nothing(tmp_path: Path) -> None:
    path = make_fmu(tmp_path / "a.fmu")
    content = path.read_bytes()
    path.write_bytes(content.replace(b"machine code", b"machine cope"))
    for _ in range(2):
        with pytest.raises(zipfile.BadZipFile):
            unpack(read_archive(path))
    assert temporary() == []
    path.unlink()
    with pytest.raises(NotAnFmuError, match="does not exist"):
        read_archive(path)


def test_few_contents_are_kept_and_none_at_the_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(unpacking, "KEPT", 2)
    for number in range(4):
        path = make_fmu(tmp_path / f"{number}.fmu", **{"resources/table.csv": str(number)})
        shutil.rmtree(unpack(read_archive(path)))
    assert len(temporary()) == 2
    unpacking._forget_all()
    assert temporary() == []


def test_a_copied_process_leaves_the_folders_to_the_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = make_fmu(tmp_path / "a.fmu")
    shutil.rmtree(unpack(read_archive(path)))
    kept = temporary()
    monkeypatch.setattr(unpacking.os, "getpid", lambda: -1)
    unpacking._forget_all()
    read_archive(path)
    assert temporary() == kept
