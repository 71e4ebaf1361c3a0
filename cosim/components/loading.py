"""Loading: an FMU file, a shipped model or a hybrid system becomes a component."""

from __future__ import annotations

import os
import shutil
import zipfile
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
from plant_models.hybrid import HybridSystem

MAX_UNPACKED_BYTES = 2 * 1024**3


def load_fmu(path: str | Path, name: str) -> Component:
    """Unpack an FMU and prepare an instance of it.

    Args:
        path: the ``.fmu`` file.
        name: name of the component.

    Raises:
        FmuLoadError: the file is missing or broken, has no co-simulation, or no library for this platform.
    """
    path = Path(path)
    description = read_description(path, name)
    if description.coSimulation is None:
        raise FmuLoadError(f"{name}: {path} offers no co-simulation interface; this master steps co-simulation FMUs only.")
    version = description.fmiVersion
    if not version.startswith(("2.", "3.")):
        raise FmuLoadError(f"{name}: {path} is FMI {version}; FMI 2.0 and 3.0 are supported.")
    _check_platform(path, name)
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
        FmuLoadError: the file is missing, is not a zip archive, unpacks to an unreasonable size, or cannot be parsed.
    """
    path = Path(path)
    if not path.is_file():
        what = "is a folder, expected an .fmu file" if path.is_dir() else "does not exist"
        raise FmuLoadError(f"{name}: FMU {path} {what}.")
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(entry.file_size for entry in archive.infolist())
        if size > MAX_UNPACKED_BYTES:
            raise FmuLoadError(f"{name}: {path} would unpack to {size / 1e9:.1f} GB; refused.")
        return fmpy.read_model_description(str(path), validate=False)
    except FmuLoadError:
        raise
    except Exception as error:
        raise FmuLoadError(f"{name}: {path} is not a readable FMU: {error}") from error


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


def _check_platform(path: Path, name: str) -> None:
    offered = fmpy.supported_platforms(str(path))
    here = {fmpy.platform, fmpy.platform_tuple}
    if not here & set(offered):
        known = ", ".join(offered) or "none"
        raise FmuLoadError(f"{name}: {path} has no library for this platform ({fmpy.platform_tuple}); it offers: {known}.")
