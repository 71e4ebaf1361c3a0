"""Cross-built libraries: their headers and symbols, their bytes, and the numbers of the one that runs here.

The reader of ELF, PE and Mach-O is LIEF's, not ours.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import fmpy
import lief
import numpy as np
import pytest
from fmpy.validation import validate_fmu

from fmus import build_fmu, recipe
from fmus.toolchain.compile import header_folder
from fmus.toolchain.platforms import PLATFORMS, host_platform
from plant_models.hybrid import HybridSystem, input_signal, output_signal

fcntl = pytest.importorskip("fcntl")  # locks of files

MACHINES = {
    "x86_64-linux": (lief.Binary.FORMATS.ELF, lief.ELF.ARCH.X86_64),
    "aarch64-linux": (lief.Binary.FORMATS.ELF, lief.ELF.ARCH.AARCH64),
    "x86_64-windows": (lief.Binary.FORMATS.PE, lief.PE.Header.MACHINE_TYPES.AMD64),
    "x86_64-darwin": (lief.Binary.FORMATS.MACHO, lief.MachO.Header.CPU_TYPE.X86_64),
    "aarch64-darwin": (lief.Binary.FORMATS.MACHO, lief.MachO.Header.CPU_TYPE.ARM64),
}
LOADER_MARKS = {"__mh_dylib_header", "___dso_handle"}  # every Mach-O library built by zig has them
ALLOWED_LIBRARIES = re.compile(
    r"lib[mc]\.so\.6|api-ms-win-crt-[a-z]+-l1-1-0\.dll|KERNEL32\.dll|/usr/lib/libSystem\.B\.dylib", re.I
)
"""Those of the system: glibc, the C runtime that is part of Windows 10, macOS."""

pytestmark = [pytest.mark.compiler, pytest.mark.foreign]


@pytest.fixture(scope="session", autouse=True)
def zig_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """The C libraries of the targets are compiled once for all workers (a minute), or were in a folder of the user's
    choice.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(
            "ZIG_GLOBAL_CACHE_DIR", os.environ.get("ZIG_GLOBAL_CACHE_DIR") or str(_shared(tmp_path_factory) / "zig")
        )
        yield


def _shared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of all workers."""
    base = tmp_path_factory.getbasetemp()
    return base.parent if "PYTEST_XDIST_WORKER" in os.environ else base


@pytest.fixture(scope="module", params=[2, 3], ids=["fmi2", "fmi3"])
def everywhere(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[int, Path]:
    """FMI version, and an observer built for all platforms, by the worker that first needs it."""
    folder = _shared(tmp_path_factory) / f"everywhere{request.param}"
    folder.mkdir(exist_ok=True)
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        for fmu in folder.glob("*.fmu"):
            return request.param, fmu
        return request.param, build_fmu(recipe("takagi_sugeno_cdo"), folder, request.param, platforms="all")


def libraries(version: int, fmu: Path, folder: Path) -> dict[str, Any]:
    """Every library of an FMU as LIEF reads it, by platform; that of ``darwin64`` gives two."""
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(folder)
    found: dict[str, Any] = {}
    for platform in PLATFORMS.values():
        old = version == 2 and platform.name.startswith("x86_64")
        path = (
            folder
            / "binaries"
            / (platform.fmi2_folder if old else platform.name)
            / f"takagi_sugeno_cdo{platform.extension}"
        )
        found[platform.name] = lief.parse(str(path))
    return found


def exported(library: Any) -> set[str]:
    names = [entry.name for entry in library.exported_functions]
    return {name.removeprefix("_") if library.format == lief.Binary.FORMATS.MACHO else name for name in names if name}


def test_headers_and_symbols(everywhere: tuple[int, Path], tmp_path: Path) -> None:
    version, fmu = everywhere
    header = (header_folder() / f"fmi{version}Functions.h").read_text()
    declared = set(re.findall(rf"FMI{version}_Export\s+\w+\s+(fmi{version}\w+);", header))
    assert len(declared) == {2: 44, 3: 75}[version]
    for name, library in libraries(version, fmu, tmp_path).items():
        kind, machine = MACHINES[name]
        found = (
            library.header.cpu_type
            if kind == lief.Binary.FORMATS.MACHO
            else (library.header.machine if kind == lief.Binary.FORMATS.PE else library.header.machine_type)
        )
        assert (library.format, found) == (kind, machine), name
        assert exported(library) - {mark.removeprefix("_") for mark in LOADER_MARKS} == declared, name
    assert validate_fmu(str(fmu)) == []


def test_nothing_but_the_system_is_needed(everywhere: tuple[int, Path], tmp_path: Path) -> None:
    version, fmu = everywhere
    for name, library in libraries(version, fmu, tmp_path).items():
        needed = [entry if isinstance(entry, str) else entry.name for entry in library.libraries]
        needed = [
            entry for entry in needed if entry not in ("takagi_sugeno_cdo.dylib", "@rpath/takagi_sugeno_cdo.dylib")
        ]
        assert needed, name
        assert [entry for entry in needed if not ALLOWED_LIBRARIES.fullmatch(entry)] == [], name


class Exponent(HybridSystem):
    """Functions of which glibc has newer versions than 2.17: exp, pow and log of 2.29."""

    name = "exponent"
    inputs = (input_signal("x", "1", 1.0),)
    outputs = (output_signal("y", "1"),)

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"y": np.exp(u.x) + np.log(2.0 + u.x) + (2.0 + u.x) ** (0.3 + u.x)}


def test_old_systems_can_load_them(everywhere: tuple[int, Path], tmp_path: Path) -> None:
    fmu = build_fmu(Exponent(), tmp_path, platforms="x86_64-linux,aarch64-linux")
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(tmp_path)
    for name in ("x86_64-linux", "aarch64-linux"):
        library = lief.ELF.parse(str(tmp_path / "binaries" / name / "exponent.so"))
        assert {"exp", "pow", "log"} <= {symbol.name for symbol in library.imported_symbols}
        wanted = [aux.name for need in library.symbols_version_requirement for aux in need.get_auxiliary_symbols()]
        versions = [tuple(map(int, text.removeprefix("GLIBC_").split("."))) for text in wanted]
        assert versions, name
        assert max(versions) <= (2, 17), name
    found = libraries(*everywhere, tmp_path / "mac")
    for name in ("x86_64-darwin", "aarch64-darwin"):
        assert tuple(found[name].build_version.minos[:2]) == (11, 0)


def test_macos_takes_them(everywhere: tuple[int, Path], tmp_path: Path) -> None:
    """macOS loads code for aarch64 only when it is signed; FMI 2 has both processors in one file."""
    version, fmu = everywhere
    found = libraries(version, fmu, tmp_path)
    assert found["aarch64-darwin"].has_code_signature
    if version == 2:
        fat = lief.MachO.parse(str(tmp_path / "binaries" / "darwin64" / "takagi_sugeno_cdo.dylib"))
        assert [fat.at(i).header.cpu_type for i in range(fat.size)] == [
            MACHINES[n][1] for n in ("x86_64-darwin", "aarch64-darwin")
        ]
        assert fat.at(1).has_code_signature


BUILD = """
import os, sys
os.umask(int(sys.argv[2]))
from fmus import build_fmu, recipe
build_fmu(recipe("odometer"), sys.argv[1] + "/host.fmu", 2)
build_fmu(recipe("odometer"), sys.argv[1] + "/all.fmu", 2, platforms="all")
"""


def test_equal_bytes_on_any_day_and_in_any_place(tmp_path: Path) -> None:
    """Two processes: other folder, temporary folder, time zone, language, mask, order of hashes, and a later time."""
    contents = []
    root = str(Path(__file__).parents[2])
    for i, (zone, language) in enumerate((("UTC", "C"), ("Asia/Tokyo", "tr_TR.UTF-8"))):
        folder = tmp_path / f"place {i}" / ("deeper" * i)
        folder.mkdir(parents=True)
        environment = os.environ | {"TZ": zone, "LC_ALL": language, "PYTHONHASHSEED": str(i + 1), "TMPDIR": str(folder)}
        environment["PYTHONPATH"] = os.pathsep.join([root, os.environ.get("PYTHONPATH", "")])
        command = [sys.executable, "-c", BUILD, str(folder), str((0o22, 0o77)[i])]
        done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        contents.append({path.name: path.read_bytes() for path in folder.iterdir()})
    assert sorted(contents[0]) == ["all.fmu", "host.fmu"]  # no cache, no scratch left in the working folder
    assert contents[0] == contents[1]


@pytest.mark.parametrize("model", ["locomotive", "takagi_sugeno_cdo"])
def test_the_system_compiler_and_zig_give_equal_numbers(model: str, version: int, tmp_path: Path) -> None:
    """Every output and state, bit for bit: no contraction, no other order of operations, the same mathematical
    library.
    """
    inputs = _effort() if model == "locomotive" else _observed(version)
    rows = []
    for platform in ("host", host_platform().name):
        fmu = str(build_fmu(recipe(model), tmp_path / platform, version, platforms=platform))  # type: ignore[arg-type]
        variables = fmpy.read_model_description(fmu).modelVariables
        names = [v.name for v in variables if v.causality in {"output", "local"} and v.type in {"Real", "Float64"}]
        run = {"stop_time": 8.0, "output_interval": 0.01, "step_size": 0.01, "fmi_type": "CoSimulation"}
        rows.append(fmpy.simulate_fmu(fmu, input=inputs, output=names, **run))
    assert np.array_equal(rows[0], rows[1])
    assert np.ptp(rows[0]["speed"]) > 0.5  # it moved


def _effort() -> np.ndarray:
    t = np.linspace(0.0, 8.0, 81)
    return np.array(list(zip(t, 9e4 * np.sin(1.1 * t), strict=True)), dtype=[("time", float), ("effort", float)])


def _observed(version: int) -> np.ndarray:
    """Inputs of an observer; in FMI 2 with a balise each second."""
    t = np.linspace(0.0, 8.0, 81)
    columns = [("time", t), ("effort", 4e4 * np.sin(t)), ("odometer", 5.0 + 4.0 * np.sin(0.7 * t))]
    kinds: list[Any] = [("time", float), ("effort", float), ("odometer", float)]
    if version == 2:
        columns += [("balise_count", np.floor(t)), ("balise_position", 5.0 * t)]
        kinds += [("balise_count", int), ("balise_position", float)]
    return np.array(list(zip(*(values for _, values in columns), strict=True)), dtype=kinds)


def test_without_a_system_compiler_zig_takes_its_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    named = build_fmu(recipe("odometer"), tmp_path / "named.fmu", platforms=host_platform().name)
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path / "nothing here"))
    assert build_fmu(recipe("odometer"), tmp_path / "host.fmu").read_bytes() == named.read_bytes()
