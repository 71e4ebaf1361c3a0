"""Importing costs little: no compiler, no other program, no plotting, no file formats before they are used."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from pages import ROOT

WATCHED = """
import json, sys
programs = []
STARTS = {"subprocess.Popen", "os.system", "os.posix_spawn", "os.fork", "os.exec", "os.spawn"}
sys.addaudithook(lambda event, arguments: programs.append(str(arguments[0])) if event in STARTS else None)
IMPORTS
print(json.dumps({"programs": programs, "modules": sorted(sys.modules)}))
"""


def import_and_watch(statement: str, folder: Path) -> dict[str, list[str]]:
    """Modules loaded and programs started by an import in a fresh interpreter that finds no program at all."""
    environment = {k: v for k, v in os.environ.items() if k not in ("CC", "PATH")}
    environment |= {
        "PATH": "",
        "PYTHONPATH": str(ROOT),
        "PYTHONDONTWRITEBYTECODE": "1",
        "FMU_OBSERVER_CACHE": str(folder),
    }
    code = WATCHED.replace("IMPORTS", statement)
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    data: dict[str, list[str]] = json.loads(done.stdout)
    return data


def started_by_fmpy(seen: dict[str, list[str]], folder: Path) -> set[str]:
    """What fmpy's own import starts: it searches the C library, for which ctypes asks the linker's cache (ldconfig)."""
    return set(import_and_watch("import fmpy.fmi2", folder)["programs"]) if "fmpy.fmi1" in seen["modules"] else set()


@pytest.mark.parametrize("package", ["plant_models", "fmu_observer", "fmus", "cosim"])
def test_import_starts_nothing_and_loads_no_plotting(package: str, tmp_path: Path) -> None:
    seen = import_and_watch(f"import {package}", tmp_path)
    assert set(seen["programs"]) <= started_by_fmpy(seen, tmp_path)
    heavy = [m for m in ("matplotlib", "scipy.io", "tqdm", "control", "sphinx", "pytest") if m in seen["modules"]]
    assert heavy == []
    assert list(tmp_path.iterdir()) == []  # nothing was written


@pytest.mark.parametrize("package", ["fmu_observer", "fmus"])
def test_lazy_packages_load_no_casadi(package: str, tmp_path: Path) -> None:
    assert "casadi" not in import_and_watch(f"import {package}", tmp_path)["modules"]


def test_what_is_offered_is_there_without_a_compiler(tmp_path: Path) -> None:
    statement = "import cosim, fmus\nassert all(hasattr(m, n) for m in (cosim, fmus) for n in m.__all__)"
    seen = import_and_watch(statement, tmp_path)
    assert set(seen["programs"]) <= started_by_fmpy(seen, tmp_path)


def test_a_program_would_be_seen(tmp_path: Path) -> None:
    statement = f"import subprocess; subprocess.run([{sys.executable!r}, '-c', ''], check=True)"
    # a set: newer Pythons start it by posix_spawn, which has an audit event of its own
    assert set(import_and_watch(statement, tmp_path)["programs"]) == {sys.executable}
