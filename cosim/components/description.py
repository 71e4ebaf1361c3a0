"""The model description of an FMU file, read without what steps it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fmpy.model_description import CoSimulation, ModelDescription, ModelVariable, Unknown

from cosim.components.unpacking import read_archive
from cosim.errors import FmuLoadError
from fmus.exchange.description import stepped_by
from fmus.fmi.archive import Archive, NotAnFmuError
from fmus.fmi.standard import INTERFACES, Interface


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


def demand_steppable(description: ModelDescription, where: str, interface: Interface | None = None) -> str:
    """Which interface type of an FMU is stepped, in the words of fmpy.

    Args:
        description: as read from the FMU. where: component and file, for messages.
        interface: that is asked for; None for co-simulation, and model exchange where there is nothing else.

    Raises:
        FmuLoadError: it does not offer it, or nothing that can be stepped.
    """
    kind = stepped_by(description, interface)
    if kind is None:
        offered = [words for name, words in INTERFACES.items() if getattr(description, name) is not None]
        wanted = interface or "co-simulation or model exchange"
        raise FmuLoadError(
            f"{where} offers {' and '.join(offered) or 'no interface'} only; {wanted} is asked for. Ask its maker for "
            "an export for co-simulation (most tools offer both)."
        )
    return kind


def runs_here(path: Path) -> str:
    """``yes``, or why an FMU file cannot run on this machine.

    Args:
        path: the ``.fmu`` file.

    Raises:
        FmuLoadError: as for `read_description`.
    """
    archive = open_fmu(path, path.name)
    kind = stepped_by(archive.description)
    if kind is None:
        return "no, it offers neither co-simulation nor model exchange"
    reason = archive.why_not_here(kind)
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
