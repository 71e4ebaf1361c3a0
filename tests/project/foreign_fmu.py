"""An FMU that is not ours: from the wheel of another project, unpacked into a folder of the test and installed nowhere else."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

WHEEL = "gemseo-fmu==3.1.1"
"""LGPL-3.0 (its FMUs are OpenModelica's); 30 MB. Only its files are read, its packages are not installed."""

FOLDER = "gemseo_fmu/problems/fmu_files/linux"


def foreign_fmu(name: str, folder: Path) -> Path:
    """The path of an FMU of the wheel, which is fetched into `folder`.

    Raises:
        RuntimeError: it cannot be fetched, or has no such FMU.
    """
    command = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-compile", "--target", str(folder), WHEEL]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    path = folder / FOLDER / f"{name}.fmu"
    if done.returncode or not path.is_file():
        raise RuntimeError(f"{WHEEL} cannot be fetched or has no {name}.fmu: {done.stderr[-500:]}")
    return path
