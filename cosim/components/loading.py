"""Loading: an FMU file, a shipped model or a hybrid system becomes a component."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from tempfile import mkdtemp
from typing import Any, Literal

import fmpy
import fmpy.fmi2
import fmpy.fmi3
from fmpy.model_description import ModelDescription

from cosim.components.component import Component
from cosim.components.fmi2 import FMI2Component
from cosim.components.fmi3 import FMI3Component
from cosim.errors import FmuLoadError
from fmu_observer.block import make_block
from fmus.check.archive import MAX_UNPACKED_BYTES, Archive, NotAnFmuError, open_archive
from plant_models.hybrid import HybridSystem


def load_fmu(path: str | Path, name: str) -> Component:
    """Unpack an FMU and prepare an instance of it.

    Args:
        path: the ``.fmu`` file.
        name: name of the component.

    Raises:
        FmuLoadError: the file is missing or broken, has no co-simulation, or no library for this platform.
    """
    path = Path(path)
    archive = _open(path, name)
    description = archive.description
    if description.coSimulation is None:
        raise FmuLoadError(f"{name}: {path} offers no co-simulation interface; this master steps co-simulation FMUs only.")
    try:
        archive.demand_this_platform()
    except NotAnFmuError as error:
        raise FmuLoadError(f"{name}: {error}") from error
    folder = Path(mkdtemp(prefix="fmu_"))
    here = Path.cwd()
    try:
        fmpy.extract(str(path), unzipdir=str(folder))
        slave = _slave(folder, description, name)
    except Exception as error:
        shutil.rmtree(folder, ignore_errors=True)
        raise FmuLoadError(f"{name}: cannot load {path}: {error}") from error
    finally:
        os.chdir(here)  # fmpy changes it while it loads, and leaves it so when it fails
    return _component_type(description)(
        name, slave, description, source=str(path), kind="FMU", release_files=lambda: shutil.rmtree(folder, ignore_errors=True)
    )


def read_description(path: str | Path, name: str = "FMU") -> ModelDescription:
    """The model description of an FMU file.

    Raises:
        FmuLoadError: the file is missing, broken or dangerous, or of an FMI version that is not supported.
    """
    return _open(Path(path), name).description


def _open(path: Path, name: str) -> Archive:
    try:
        return open_archive(path, MAX_UNPACKED_BYTES)
    except NotAnFmuError as error:
        raise FmuLoadError(f"{name}: {error}") from error


def load_block(system: HybridSystem, name: str, fmi_version: Literal[2, 3] = 3, **arguments: Any) -> Component:
    """A Python block as a component; further arguments as for `fmu_observer.block.Face`."""
    block = make_block(system, fmi_version, instance_name=name, **arguments)
    source = system.source or type(system).__qualname__
    return _component_type(block.model_description)(name, block, block.model_description, source=source, kind="block")


def _component_type(description: ModelDescription) -> type[Component]:
    return FMI2Component if description.fmiVersion.startswith("2.") else FMI3Component


def _slave(folder: Path, description: ModelDescription, name: str) -> Any:
    arguments = {
        "guid": description.guid,
        "modelIdentifier": description.coSimulation.modelIdentifier,
        "unzipDirectory": str(folder),
        "instanceName": name,
    }
    if description.fmiVersion.startswith("2."):
        return fmpy.fmi2.FMU2Slave(**arguments)
    return fmpy.fmi3.FMU3Slave(**arguments)
