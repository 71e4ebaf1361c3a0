"""The model description of an FMU file, read without what steps it."""

from __future__ import annotations

from pathlib import Path

from fmpy.model_description import ModelDescription

from cosim.components.unpacking import read_archive
from cosim.errors import FmuLoadError
from fmus.fmi.archive import Archive, NotAnFmuError
from fmus.fmi.standard import CO_SIMULATION


def read_description(path: str | Path, name: str = "FMU") -> ModelDescription:
    """The model description of an FMU file.

    Args:
        path: the ``.fmu`` file.
        name: of the component, for messages.

    Raises:
        FmuLoadError: the file is missing, broken or dangerous, or of an FMI version that is not supported.
    """
    return open_fmu(Path(path), name).description


def runs_here(path: Path) -> str:
    """``yes``, or why the co-simulation of an FMU file cannot run on this machine.

    Args:
        path: the ``.fmu`` file.

    Raises:
        FmuLoadError: as for `read_description`.
    """
    archive = open_fmu(path, path.name)
    if archive.description.coSimulation is None:
        return "no, it offers no co-simulation"
    reason = archive.why_not_here(CO_SIMULATION)
    return f"no, it {reason}" if reason else "yes"


def open_fmu(path: Path, name: str) -> Archive:
    """Look at an FMU file; nothing is unpacked.

    Args:
        path: the ``.fmu`` file.
        name: of the component, for messages.

    Raises:
        FmuLoadError: as for `read_description`.
    """
    try:
        return read_archive(path)
    except NotAnFmuError as error:
        raise FmuLoadError(f"{name}: {error}") from error
