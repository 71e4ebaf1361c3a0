"""FMU files: what is inside, the same bytes each time, nothing left of a failed build, found again in the cache."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import fmpy
import pytest

import fmus
from fmus import CompilationError, CompilerMissing, GenerationError, build_fmu, cache_folder, cached_fmu
from fmus.build import MAIN_SOURCE
from fmus.pack import pack_fmu
from fmus.toolchain.compile import compile_library, find_compiler, header_folder
from plant_models.disk_cache import folder
from plant_models.hybrid import HybridSystem, TracingError, vector


@pytest.fixture
def tracker(reference: Callable[[str], Any]) -> HybridSystem:
    made: HybridSystem = reference("tracker").system
    return made


@pytest.fixture
def failing_compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A compiler that says its version and then fails."""
    script = tmp_path / "broken_cc.py"
    script.write_text("import sys\nsys.exit(0 if '--version' in sys.argv else 'model.c:1: no, thank you')\n")
    monkeypatch.setenv("CC", f"{Path(sys.executable).as_posix()} {script.as_posix()}")


@pytest.mark.compiler
def test_content(tracker: HybridSystem, version: int, tmp_path: Path) -> None:
    fmu = build_fmu(tracker, tmp_path / "new" / "folder", version)  # type: ignore[arg-type]
    assert fmu == tmp_path / "new" / "folder" / "tracker.fmu"
    platform = "binaries/" + (fmpy.platform if version == 2 else fmpy.platform_tuple)
    with zipfile.ZipFile(fmu) as archive:
        names = archive.namelist()
        assert {entry.date_time for entry in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
    assert names == sorted(names)
    assert f"{platform}/tracker{fmpy.sharedLibraryExtension}" in names
    assert {"modelDescription.xml", "sources/model.c", "sources/runtime.c", f"sources/fmi{version}.c"} <= set(names)
    assert [name for name in names if name.startswith(f"sources/fmi{5 - version}")] == []
    assert ("sources/buildDescription.xml" in names) == (version == 3)
    headers = {f"sources/{path.name}" for path in header_folder().glob(f"fmi{version}*.h")}
    assert len(headers) == 3
    assert headers <= set(names)
    assert {"documentation/index.html", "documentation/licenses/license.txt"} <= set(names)
    assert list(fmu.parent.iterdir()) == [fmu]


@pytest.mark.compiler
def test_sources_in_the_fmu_give_its_library(tracker: HybridSystem, version: int, tmp_path: Path) -> None:
    fmu = build_fmu(tracker, tmp_path / "one.fmu", version)  # type: ignore[arg-type]
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(tmp_path)
    library = next((tmp_path / "binaries").rglob("tracker.*"))
    again = compile_library(find_compiler(), tmp_path / "sources", [MAIN_SOURCE], library.name)
    assert again.read_bytes() == library.read_bytes()


@pytest.mark.compiler
def test_equal_bytes_each_time(
    version: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reference: Callable[[str], Any]
) -> None:
    first = build_fmu(reference("sampler").system, tmp_path / "a.fmu", version)  # type: ignore[arg-type]
    monkeypatch.setenv("TZ", "Asia/Tokyo")
    second = build_fmu(reference("sampler").system, tmp_path / "other" / "b.fmu", version)  # type: ignore[arg-type]
    assert first.read_bytes() == second.read_bytes()


@pytest.mark.compiler
def test_cache_returns_one_file(tracker: HybridSystem, version: int, reference: Callable[[str], Any]) -> None:
    first = cached_fmu(tracker, version)  # type: ignore[arg-type]
    modified = first.stat().st_mtime_ns
    assert cached_fmu(tracker, version) == first  # type: ignore[arg-type]
    assert cached_fmu(reference("tracker").system, version) == first  # an equal system, traced anew
    assert first.stat().st_mtime_ns == modified
    assert cache_folder() in first.parents


@pytest.mark.compiler
def test_cache_distinguishes_systems(tracker: HybridSystem, reference: Callable[[str], Any]) -> None:
    changed = type("Tracker", (type(tracker),), {"jump": lambda _s, _e, _t, x, _u, _p: {"speed": 2.0 * x.speed}})()
    changed_start = type("Tracker", (type(tracker),), {"internal_step": 0.02})()
    paths = {cached_fmu(one) for one in (tracker, changed, changed_start, reference("slider").system)} | {
        cached_fmu(tracker, 2)
    }
    assert len(paths) == 5


@pytest.mark.compiler
def test_cache_rebuilds_what_was_deleted(tracker: HybridSystem) -> None:
    first = cached_fmu(tracker)
    content = first.read_bytes()
    first.unlink()
    assert cached_fmu(tracker).read_bytes() == content


@pytest.mark.compiler
def test_cache_serves_many_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reference: Callable[[str], Any]
) -> None:
    monkeypatch.setenv("FMU_OBSERVER_CACHE", str(tmp_path / "shared"))
    with ThreadPoolExecutor(4) as pool:
        systems = [type(reference("gain").system)() for _ in range(4)]  # each to be built, as in four processes
        paths = list(pool.map(cached_fmu, systems))
    assert len(set(paths)) == 1
    assert sorted(p.name for p in paths[0].parent.iterdir()) == ["gain.fmu", "gain.sha256"]


def test_cache_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(folder.sys, "platform", "linux")
    monkeypatch.delenv("FMU_OBSERVER_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_folder() == tmp_path / "fmu-observer"
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert cache_folder() == Path.home() / ".cache" / "fmu-observer"
    monkeypatch.setattr(folder.sys, "platform", "win32")
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path))
    assert cache_folder() == tmp_path / "fmu-observer" / "Cache"


@pytest.mark.usefixtures("failing_compiler")
def test_failed_build_leaves_nothing(tracker: HybridSystem, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FMU_OBSERVER_CACHE", str(tmp_path / "cache"))
    target = tmp_path / "out"
    target.mkdir()
    older = target / "tracker.fmu"
    older.write_text("an older build")
    with pytest.raises(CompilationError, match="no, thank you"):
        build_fmu(tracker, target)
    with pytest.raises(CompilationError):
        cached_fmu(tracker)
    assert [p.name for p in target.iterdir()] == ["tracker.fmu"]
    assert older.read_text() == "an older build"
    assert not (tmp_path / "cache").exists()


def test_interrupted_packing_leaves_nothing(tmp_path: Path) -> None:
    content: Any = {"modelDescription.xml": b"<a/>", "sources/model.c": None}  # the second cannot be written
    with pytest.raises(TypeError):
        pack_fmu(content, tmp_path / "half.fmu")
    assert list(tmp_path.iterdir()) == []


def test_missing_compiler_says_what_to_install(
    tracker: HybridSystem, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setitem(sys.modules, "ziglang", None)
    with pytest.raises(CompilerMissing, match="Install one"):
        build_fmu(tracker, tmp_path)
    monkeypatch.setenv("CC", "no-such-compiler -O1")
    with pytest.raises(CompilerMissing, match="'no-such-compiler -O1', which does not exist"):
        find_compiler()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.compiler
def test_flags_of_the_environment_come_last_and_another_build_is_another_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CFLAGS", "")
    plain = find_compiler()
    monkeypatch.setenv("CFLAGS", "-O1 -DNAME='a b'")
    compiler = find_compiler()
    assert compiler.flags == (*plain.flags, "-O1", "-DNAME=a b")
    assert compiler.identity() != plain.identity()


def test_what_cannot_be_traced_is_refused(tracker: HybridSystem, tmp_path: Path) -> None:
    opaque = type("Opaque", (type(tracker),), {"traceable": False})()
    with pytest.raises(GenerationError, match="cannot be traced"):
        build_fmu(opaque, tmp_path)
    long = type("Long", (type(tracker),), {"jump": lambda *_: {"innovation": vector(1.0, 2.0)}})()
    # its C would write past the end of an array
    with pytest.raises(TracingError, match=r"returns 'innovation' of shape \(2,\); expected one number"):
        build_fmu(long, tmp_path)
    with pytest.raises(ValueError, match="FMI version 1"):
        build_fmu(tracker, tmp_path, 1)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="unknown preset 'wet'"):
        build_fmu(tracker, tmp_path, preset="wet")
    assert list(tmp_path.iterdir()) == []


def test_import_is_cheap() -> None:
    code = "import sys, fmus; print([m for m in ('casadi', 'fmpy', 'numpy', 'subprocess') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_public_names_exist() -> None:
    for name in fmus.__all__:
        assert getattr(fmus, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'bake'"):
        _ = fmus.bake
