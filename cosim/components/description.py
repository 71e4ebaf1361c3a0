"""The model description of an FMU file, read without what steps it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fmpy.model_description import CoSimulation, ModelDescription, ModelVariable, Unknown

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


def description_of_outputs(
    name: str, token: str, text: str, outputs: Sequence[ModelVariable], **abilities: Any
) -> ModelDescription:
    """The description of what has outputs alone, and is made here.

    Args:
        name: of the model. token: by which another one is recognised. text: what it is. outputs: its variables.
        abilities: of its co-simulation, `modelIdentifier` among them, in the words of FMI.
    """
    return ModelDescription(
        fmiVersion="3.0",
        modelName=name,
        instantiationToken=token,
        description=text,
        generationTool=abilities["modelIdentifier"],
        coSimulation=CoSimulation(**abilities),
        modelVariables=list(outputs),
        outputs=[Unknown(variable=variable, dependencies=[]) for variable in outputs],
    )


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
        raise FmuLoadError(str(error) if name == path.name else f"{name}: {error}") from error
