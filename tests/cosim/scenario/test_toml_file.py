"""Scenario files as editors and version control leave them: read where that is clear, else refused in words."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import pytest

from cosim import Scenario
from cosim.errors import ScenarioError
from cosim.scenario.toml_file import read_toml

TEXT = "stop = 1.0\nstep = 0.1\n"


def archive() -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as made:
        made.writestr("modelDescription.xml", "<a/>")
    return file.getvalue()


@pytest.mark.parametrize(
    "data", [TEXT.encode("utf-8-sig"), TEXT.replace("\n", "\r\n").encode()], ids=["mark", "windows"]
)
def test_a_file_from_windows_is_read(data: bytes, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_bytes(data)
    assert read_toml(tmp_path / "a.toml") == {"stop": 1.0, "step": 0.1}


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (TEXT.encode("utf-16"), "line 1 is not UTF-8; save the file as UTF-8"),
        (b"title = 'x'\n# caf\xe9\n", "line 2 is not UTF-8"),
        (
            b"stop = 1.0\n<<<<<<< HEAD\nstep = 0.1\n=======\nstep = 0.2\n>>>>>>> x\n",
            "line 2 begins the conflict of a merge",
        ),
        (b"stop = \n", "line 1: stop has no value behind ="),
        (archive(), "'cosim new' writes a scenario"),
    ],
    ids=["utf-16", "latin-1", "conflict", "typing", "fmu"],
)
def test_what_cannot_be_read_is_said_with_its_place(data: bytes, message: str, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_bytes(data)
    with pytest.raises(ScenarioError, match=r"a\.toml: not readable as TOML") as reported:
        Scenario.load(tmp_path / "a.toml")
    assert message in str(reported.value)
