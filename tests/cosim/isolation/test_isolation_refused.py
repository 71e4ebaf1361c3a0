"""What cannot be isolated is refused in words: no such platform, no compiler, limits of zero, a program that does not
start, a library for another machine."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from harmful_fmus import LAG
from test_fmus.build import linear_fmu

from cosim import Scenario
from cosim.cli import main
from cosim.errors import CosimError
from fmus.isolation import library, programs
from fmus.isolation.programs import IsolationPrograms, isolation_programs
from fmus.pack import pack_fmu

pytestmark = [pytest.mark.compiler, pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="Linux")]


@pytest.fixture(autouse=True)
def asked_anew() -> Iterator[None]:
    programs._programs.cache_clear()
    yield
    programs._programs.cache_clear()


def isolated(folder: Path) -> Scenario:
    fmu = linear_fmu(folder, "lag", **LAG, inputs=["u"], outputs=["y"], version=2)
    return Scenario(stop=0.1, step=0.01).add("lag", fmu=str(fmu), isolate="component")


def refused(scenario: Scenario) -> str:
    with pytest.raises(CosimError) as error:
        scenario.run(warn=lambda _: None)
    return str(error.value)


@pytest.mark.parametrize("key", ["processes", "memory", "files", "file_bytes", "output_bytes"])
def test_limits_of_zero_are_refused(tmp_path: Path, key: str) -> None:
    with pytest.raises(CosimError, match=f"limits.{key}"):
        isolated(tmp_path).set(f"lag.limits.{key}", 0).table()


def test_a_shipped_model_has_no_process_of_its_own() -> None:
    with pytest.raises(CosimError, match="'isolate' belongs to an FMU by path"):
        Scenario(stop=1.0, step=0.1).add("train", model="locomotive", isolate="component").table()


@pytest.mark.parametrize(("system", "machine"), [("win32", "AMD64"), ("darwin", "arm64"), ("linux", "riscv64")])
def test_other_platforms_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, system: str, machine: str) -> None:
    scenario = isolated(tmp_path)
    monkeypatch.setattr(programs.sys, "platform", system)
    monkeypatch.setattr(programs.platform, "machine", lambda: machine)
    said = refused(scenario)
    assert f"processes of their own on Linux with x86-64 or aarch64 (here: {system}, {machine.lower()})" in said


def test_a_missing_compiler_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = isolated(tmp_path)
    monkeypatch.setenv("CC", "no-such-compiler")
    assert "no-such-compiler" in refused(scenario)


def test_a_program_that_does_not_start_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    proxy = isolation_programs().proxy
    monkeypatch.setattr(library, "isolation_programs", lambda: IsolationPrograms(proxy, tmp_path / "gone"))
    assert "its process cannot be started: No such file or directory" in refused(isolated(tmp_path))
    monkeypatch.setattr(library, "isolation_programs", lambda: IsolationPrograms(proxy, Path("/bin/false")))
    assert "its process and the one that watched it were ended from outside in loading its library" in refused(
        isolated(tmp_path)
    )


def test_a_library_that_cannot_be_loaded_is_told(tmp_path: Path) -> None:
    with zipfile.ZipFile(isolated(tmp_path).table().components["lag"].fmu or "") as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    place = next(name for name in content if name.endswith(".so"))
    content[place] = content[place][:18] + b"\xb7\0" + content[place][20:]  # as for aarch64, or for no machine
    if content[place][18:20] == b"\xb7\0":
        content[place] = content[place][:18] + b"\xf3\0" + content[place][20:]  # RISC-V
    pack_fmu(content, tmp_path / "foreign.fmu")
    scenario = Scenario(stop=0.1, step=0.01).add("lag", fmu=str(tmp_path / "foreign.fmu"), isolate="component")
    assert "cannot load" in refused(scenario)


def test_the_command_takes_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = isolated(tmp_path).save(tmp_path / "lag.toml")
    assert main(["run", str(path), "--isolate", "component", "--out", str(tmp_path / "out"), "--no-report"]) == 0
    assert main(["run", str(path), "--isolate", "everything", "--out", str(tmp_path / "out")]) == 2
    assert "isolate" in capsys.readouterr().err
