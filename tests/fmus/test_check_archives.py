"""Files that are no FMU, broken, dangerous or for another machine: refused with the reason before anything is
unpacked.
"""

from __future__ import annotations

import struct
import tempfile
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path

import fmpy
import pytest
from lying_fmus import description

from fmus.check import Class, check_fmu
from fmus.check.checks.archive_checks import platforms
from fmus.cli import main
from fmus.fmi import archive as archives
from fmus.fmi.archive import NotAnFmuError, open_archive

LIBRARY = f"binaries/{fmpy.platform}/liar{fmpy.sharedLibraryExtension}"


def zipped(folder: Path, files: Mapping[str, str | bytes]) -> Path:
    path = folder / "odd.fmu"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return path


@pytest.fixture(autouse=True)
def _nothing_is_unpacked_and_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(scratch))
    yield
    assert list(scratch.iterdir()) == []


def refused(path: Path, match: str) -> None:
    with pytest.raises(NotAnFmuError, match=match):
        check_fmu(path)


def test_missing_files_folders_and_no_archives(tmp_path: Path) -> None:
    refused(tmp_path / "none.fmu", "does not exist")
    refused(tmp_path, "is a folder; expected an .fmu file")
    text = tmp_path / "text.fmu"
    text.write_text("hello")
    refused(text, "not a readable FMU: not a zip archive")
    whole = zipped(tmp_path, {"modelDescription.xml": description()})
    whole.write_bytes(whole.read_bytes()[:-30])
    refused(whole, "not a readable FMU")


@pytest.mark.parametrize(
    ("files", "match"),
    [
        ({"readme.txt": "hello"}, "it has no modelDescription.xml"),
        ({"modelDescription.xml": "<fmiModelDescription"}, "modelDescription.xml cannot be parsed"),
        ({"modelDescription.xml": description(None)}, "neither co-simulation, model exchange, scheduled execution"),
        (
            {"modelDescription.xml": description(), "../evil": ""},
            "'../evil', which leads outside of the archive; refused",
        ),
        ({"modelDescription.xml": description(), "/evil": ""}, "leads outside"),
        ({"modelDescription.xml": description(), "resources/../../evil": ""}, "leads outside"),
        ({"modelDescription.xml": description(), "C:evil": ""}, "leads outside"),
        ({"modelDescription.xml": description(), "resources\\evil": ""}, "leads outside"),
        ({"modelDescription.xml": description()}, rf"\(binaries/{fmpy.platform} is needed\); it offers: none"),
        ({"modelDescription.xml": description(), "binaries/vax/liar.so": ""}, "is needed.*it offers: vax"),
        (
            {"modelDescription.xml": description(), LIBRARY.replace("liar", "other"): ""},
            "other.so where .*liar.so is wanted",
        ),
    ],
)
def test_archives_that_are_refused(files: Mapping[str, str], match: str, tmp_path: Path) -> None:
    refused(zipped(tmp_path, files), match)


def test_fmi_1_is_refused(tmp_path: Path) -> None:
    counts = 'numberOfContinuousStates="0" numberOfEventIndicators="0"'
    head = f'<fmiModelDescription fmiVersion="1.0" modelName="m" modelIdentifier="m" guid="1" {counts}>'
    xml = f"{head}<ModelVariables/></fmiModelDescription>"
    refused(zipped(tmp_path, {"modelDescription.xml": xml}), "is FMI 1.0; FMI 2.0 and 3.0 are supported")


def test_a_bomb_is_not_unpacked(tmp_path: Path) -> None:
    """A megabyte of zeros takes a kilobyte; the limit is lowered so that the test need not make gigabytes."""
    path = zipped(tmp_path, {"modelDescription.xml": description(), LIBRARY: b"\0" * 1_000_000})
    assert path.stat().st_size < 5000
    with pytest.raises(NotAnFmuError, match=r"would unpack to 0.0 GB; refused: 2 files, the limit is"):
        open_archive(path, max_bytes=900_000)
    assert archives.MAX_UNPACKED_BYTES >= 1024**3  # honest FMUs are large


def test_an_encrypted_file_is_refused(tmp_path: Path) -> None:
    path = zipped(tmp_path, {"modelDescription.xml": description(), LIBRARY: b"x"})
    content = bytearray(path.read_bytes())
    entry = content.rindex(b"PK\x01\x02")
    struct.pack_into("<H", content, entry + 8, 1)  # general purpose flag of the last central entry
    path.write_bytes(content)
    refused(path, "encrypted file")


def test_a_file_that_is_not_what_it_declares(tmp_path: Path) -> None:
    """The size is understated and the content altered: both are noticed when it is unpacked, and nothing runs."""
    path = zipped(tmp_path, {"modelDescription.xml": description(), LIBRARY: b"some bytes that are no library" * 10})
    content = bytearray(path.read_bytes())
    struct.pack_into("<I", content, content.rindex(b"PK\x01\x02") + 24, 10)  # uncompressed size
    path.write_bytes(content)
    refused(path, "is a corrupt archive")


def test_a_library_that_cannot_be_loaded_here_is_not_evaluated(tmp_path: Path) -> None:
    path = zipped(tmp_path, {"modelDescription.xml": description(), LIBRARY: b"no library"})
    refused(path, "cannot be run on this machine .*: loading the library failed")


@pytest.mark.parametrize("compression", [zipfile.ZIP_DEFLATED, zipfile.ZIP_LZMA, zipfile.ZIP_BZIP2])
def test_damage_inside_is_reported_whatever_the_compression(
    compression: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "damaged.fmu"
    with zipfile.ZipFile(path, "w", compression) as archive:
        archive.writestr("modelDescription.xml", description(), zipfile.ZIP_STORED)
        archive.writestr(LIBRARY, bytes(range(256)) * 40)
    content, header = bytearray(path.read_bytes()), len(LIBRARY) + 30
    begin = content.index(LIBRARY.encode()) - 30 + header
    content[begin + 4 : begin + 24] = b"\xff" * 20
    path.write_bytes(content)
    assert main(["check", str(path)]) == 2
    said = capsys.readouterr().err
    assert "is a corrupt archive" in said
    assert "Traceback" not in said


def test_foreign_platforms_are_named_and_not_checked(tmp_path: Path) -> None:
    path = zipped(tmp_path, {"modelDescription.xml": description(), LIBRARY: b"", "binaries/vax/liar.so": b""})
    assert platforms(open_archive(path)).detail.endswith("not checked here: vax")


def test_scheduled_execution_is_not_run(tmp_path: Path) -> None:
    xml = (
        '<?xml version="1.0"?><fmiModelDescription fmiVersion="3.0" modelName="m" instantiationToken="t">'
        '<ScheduledExecution modelIdentifier="liar"/><ModelVariables>'
        '<Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>'
        "</ModelVariables><ModelStructure/></fmiModelDescription>"
    )
    library = f"binaries/{fmpy.platform_tuple}/liar{fmpy.sharedLibraryExtension}"
    report = check_fmu(zipped(tmp_path, {"modelDescription.xml": xml, library: b""}))
    assert report.finding("scheduled execution").verdict == "skipped"
    assert report.trust == ("Nothing: it was not run.",)
    assert report.verdict is Class.LIMITS
