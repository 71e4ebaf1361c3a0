"""An FMU that does a deed in one of its functions: see ``harmful.c``."""

from __future__ import annotations

import os
import zipfile
from dataclasses import replace
from functools import cache
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from test_fmus.build import linear_fmu
from test_fmus.description import Version

from fmus.pack import pack_fmu
from fmus.toolchain.compile import compile_library, find_compiler, library_name

CALLS: dict[int, dict[str, str]] = {
    version: {
        "load": "loading",
        "instantiate": instantiate,
        "initialise": initialise,
        "set": f"Set{real}",
        "step": "DoStep",
        "get": f"Get{real}",
        "terminate": f"Terminate{slave}",
        "free": f"Free{slave}Instance",
        "unload": "unloading",
    }
    for version, real, slave, instantiate, initialise in (
        (1, "Real", "Slave", "InstantiateSlave", "InitializeSlave"),
        (2, "Real", "", "Instantiate", "EnterInitializationMode"),
        (3, "Float64", "", "InstantiateCoSimulation", "EnterInitializationMode"),
    )
}
"""What a moment of a life is called in a version of FMI."""
LAG: dict[str, Any] = {"A": [[-1.0]], "B": [[1.0]], "C": [[1.0]], "D": [[0.0]], "x0": [1.0]}


def harmful_fmu(folder: Path, version: Version) -> Path:
    """A lag, ``y' = u - y`` from 1, whose library is not its own."""
    lag = linear_fmu(folder, "lag", **LAG, inputs=["u"], outputs=["y"], version=version)
    with zipfile.ZipFile(lag) as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    place = next(name for name in content if name.endswith(library_name("lag")))
    content[str(Path(place).with_name("real.so"))] = content[place]
    content[place] = _library(version)
    return pack_fmu(content, folder / f"harmful{version}.fmu")


@cache
def _library(version: int) -> bytes:
    compiler = find_compiler()
    defined = {"VERSION": version, "REAL": '"real.so"', "FUNCTIONS_HERE": f"FMI{version}_FUNCTIONS"}
    defined |= {"PREFIX": "lag_" if version == 1 else "", "BEGIN": '"fmi"' if version == 1 else f'"fmi{version}"'}
    flags = [f"-D{name}={value}" for name, value in defined.items()]
    with TemporaryDirectory() as scratch:
        (Path(scratch) / "harmful.c").write_bytes((Path(__file__).parent / "harmful.c").read_bytes())
        (Path(scratch) / "functions.h").write_bytes((files("fmus.isolation") / "functions.h").read_bytes())
        compiler = replace(compiler, flags=(*compiler.flags, "-O0", "-w", *flags))
        made = compile_library(compiler, Path(scratch), ["harmful.c", "-lpthread", "-ldl"], "harmful.so")
        return made.read_bytes()


def processes_of_fmus() -> list[str]:
    """Processes of isolated FMUs of this process, and what these have started."""
    found, waiting = [], [str(os.getpid())]
    while waiting:
        for tasks in Path(f"/proc/{waiting.pop()}/task").glob("*/children"):
            numbers = tasks.read_text().split()
            waiting += numbers
            found += [n for n in numbers if "isolated" in Path(f"/proc/{n}/cmdline").read_text()]
    return found
