"""Two FMUs that bring libraries of one name: the second one is refused where they differ."""

from __future__ import annotations

import ctypes
import subprocess
import sys
from pathlib import Path

import pytest
from test_fmus.events import hostile_fmu

from cosim import Scenario
from cosim.components.loading import _own_needs, _read_linkage
from cosim.errors import CosimError
from fmus.toolchain.compile import find_compiler

pytestmark = [pytest.mark.compiler, pytest.mark.skipif(sys.platform != "linux", reason="ELF")]


def helper(folder: Path, value: int, soname: str) -> Path:
    """A shared library whose function gives this value."""
    folder.mkdir()
    (folder / "helper.c").write_text(f"int helper_value(void) {{ return {value}; }}\n")
    path = folder / soname
    command = [
        *find_compiler().command,
        "-shared",
        "-fPIC",
        f"-Wl,-soname,{soname}",
        str(folder / "helper.c"),
        "-o",
        str(path),
    ]
    subprocess.run(command, check=True, capture_output=True)
    return path


def pair(folder: Path, soname: str, *values: int) -> Scenario:
    scenario = Scenario(stop=0.1, step=0.01)
    for number, value in enumerate(values):
        fmu = hostile_fmu(folder, f"bringer{number}", beside=helper(folder / f"helper{number}", value, soname))
        scenario.add(f"part{number}", fmu=str(fmu))
    return scenario


def test_the_names_are_read_from_the_file(tmp_path: Path) -> None:
    linkage = _read_linkage(helper(tmp_path / "a", 1, "libread_names.so.3"))
    assert linkage is not None
    assert linkage.soname == "libread_names.so.3"
    (tmp_path / "torn.so").write_bytes((tmp_path / "a" / "libread_names.so.3").read_bytes()[:100])
    (tmp_path / "text.so").write_text("INPUT(libm.so.6)")
    assert _read_linkage(tmp_path / "torn.so") is None
    assert _read_linkage(tmp_path / "text.so") is None


def test_different_libraries_of_one_name_are_refused(tmp_path: Path) -> None:
    with pytest.raises(
        CosimError, match=r"part1: .*bringer1\.fmu and .*bringer0\.fmu each bring a library libtwo_kinds\.so"
    ):
        pair(tmp_path, "libtwo_kinds.so", 1, 2).run()


def test_a_library_that_the_program_has_loaded_is_nobodys(tmp_path: Path) -> None:
    ctypes.CDLL(str(helper(tmp_path / "program", 5, "libof_the_program.so")))
    assert pair(tmp_path, "libof_the_program.so", 1).run().failure is None


def test_what_an_fmu_brings_is_found_by_its_soname_and_through_others(tmp_path: Path) -> None:
    """The library asks for one of another file name, and that one for a third; libc is nobody's."""
    last = helper(tmp_path / "fmu", 1, "liblast.so.1")
    compiler, own = list(find_compiler().command), tmp_path / "fmu"
    for name, needed in (("libmiddle.so.2", last), ("main.so", own / "libmiddle.so.2")):
        flags = ["-shared", "-fPIC", "-Wl,--no-as-needed", "-Wl,--allow-shlib-undefined", f"-Wl,-soname,{name}"]
        subprocess.run([*compiler, *flags, str(own / "helper.c"), str(needed), "-o", str(own / name)], check=True)
    renamed = last.rename(own / "last.so")
    assert _own_needs(own / "main.so") == {"libmiddle.so.2": own / "libmiddle.so.2", "liblast.so.1": renamed}


def test_one_library_may_come_twice(tmp_path: Path) -> None:
    assert pair(tmp_path, "libof_one_kind.so", 1, 1).run().failure is None
