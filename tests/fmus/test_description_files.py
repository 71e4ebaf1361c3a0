"""Files of model descriptions are closed again, whatever stands in them."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest

from fmus.fmi.description import read_description

OPEN = Path("/proc/self/fd")


@pytest.mark.skipif(not OPEN.is_dir(), reason="the open files of a process are listed by Linux")
@pytest.mark.parametrize("text", ["<fmiModelDescription", '<fmiModelDescription fmiVersion="7.0"/>'])
def test_a_broken_description_leaves_no_file_open(text: str, tmp_path: Path) -> None:
    path = tmp_path / "broken.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", text)
    with pytest.raises(Exception, match=r"line 1|Unsupported FMI version") as error:
        read_description(path)
    assert error.tb is not None  # it is held, and all that stands in its frames
    assert str(path) not in [str(entry.readlink()) for entry in OPEN.iterdir() if entry.is_symlink() and entry.exists()]
