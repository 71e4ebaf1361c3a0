"""Section ``step`` of `native_fmu`: what calls of the Takagi-Sugeno observer cost, raw from C and through fmpy, and its
block.
"""

from __future__ import annotations

import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmpy.model_description import ModelDescription

from fmu_observer.block import make_block
from fmus import build_fmu, recipe
from fmus.toolchain.compile import find_compiler, header_folder

MODEL = "takagi_sugeno_cdo"
H = 0.001
ARGUMENTS = ("effort", "odometer", "balise_count", "balise_time", "position", "late_policy")
CALLS = 20_000


def step() -> None:
    """Cost of doStep at 1 ms steps, of events on time and late, of saving and restoring."""
    with tempfile.TemporaryDirectory(prefix="native-step-") as folder:
        _step(Path(folder))


def _step(folder: Path) -> None:
    made = {version: _unpack(folder, version) for version in (2, 3)}
    print(f"{MODEL}, FMI 2, raw calls from C")
    _raw(folder, *made[2])
    print(f"{MODEL}, through fmpy")
    slaves: dict[str, Any] = {f"FMI {version}": _slave(version, *made[version]) for version in (2, 3)}
    slaves["block, FMI 3"] = make_block(recipe(MODEL), 3)
    for name, slave in slaves.items():
        _drive(name, slave, made[2 if name == "FMI 2" else 3][1])


def _unpack(folder: Path, version: Any) -> tuple[Path, ModelDescription]:
    fmu = build_fmu(recipe(MODEL), folder / f"fmi{version}.fmu", version)
    return Path(extract(str(fmu), str(folder / f"fmi{version}"))), read_model_description(str(fmu), validate=False)


def _raw(folder: Path, unpacked: Path, description: ModelDescription) -> None:
    source, program = Path(__file__).with_name("native_step.c"), folder / "native_step"
    command = [*find_compiler().command, "-O2", f"-I{header_folder()}", str(source), "-o", str(program), "-ldl"]
    subprocess.run(command, check=True)
    references = {v.name: str(v.valueReference) for v in description.modelVariables}
    (library,) = (unpacked / "binaries").glob(f"*/{MODEL}.*")
    subprocess.run(
        [str(program), str(library), description.guid, *(references[name] for name in ARGUMENTS)], check=True
    )


def _slave(version: int, unpacked: Path, description: ModelDescription) -> Any:
    kind = FMU2Slave if version == 2 else FMU3Slave
    return kind(guid=description.guid, unzipDirectory=str(unpacked), modelIdentifier=MODEL, instanceName=MODEL)


def _drive(name: str, slave: Any, description: ModelDescription) -> None:
    is_2 = name == "FMI 2"
    if is_2:
        slave.instantiate()
        slave.setupExperiment()
        slave.enterInitializationMode()
    else:
        slave.instantiate(eventModeUsed=True)
        slave.enterInitializationMode()
    slave.exitInitializationMode()
    if not is_2:
        slave.enterStepMode()
    numbers = iter(range(10**9))
    _report(f"{name}: doStep", lambda: slave.doStep(next(numbers) * H, H))
    if not is_2:
        references = {v.name: v.valueReference for v in description.modelVariables}
        _report(f"{name}: balise event", lambda: _balise(slave, references))
    slave.terminate()
    slave.freeInstance()


def _balise(slave: Any, references: dict[str, int]) -> None:
    slave.enterEventMode()
    slave.setClock([references["balise"]], [True])
    slave.setFloat64([references["balise_position"]], [100.0])
    slave.updateDiscreteStates()
    slave.enterStepMode()


def _report(what: str, call: Callable[[], object]) -> None:
    for _ in range(CALLS // 10):
        call()
    begin = time.perf_counter()
    for _ in range(CALLS):
        call()
    print(f"  {what:<58} {(time.perf_counter() - begin) / CALLS * 1e6:8.3f} us")
