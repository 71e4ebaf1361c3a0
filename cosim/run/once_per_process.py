"""Instances: FMUs that may be instantiated only once in a process are not used twice. Reads descriptions, loads
nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from fmpy.model_description import ModelDescription

from cosim.components.description import read_description
from cosim.errors import CouplingError
from fmus.fmi.capabilities import read_capabilities


def check_instances(files: Mapping[str, Path], where: str) -> None:
    """Refuse a second component of an FMU that allows one instance in a process (canBeInstantiatedOnlyOncePerProcess).

    Two files are the same FMU where model identifier and GUID (instantiation token) agree.

    Args:
        files: FMU file by component name. where: place for messages.

    Raises:
        CouplingError: two components are such an FMU; both are named.
        FmuLoadError: a file cannot be read.
    """
    if len(files) < 2:
        return
    first: dict[tuple[str, str], str] = {}
    descriptions: dict[Path, ModelDescription] = {}
    for name, path in files.items():
        if path not in descriptions:
            descriptions[path] = read_description(path, name)
        description = descriptions[path]
        if not read_capabilities(description).canBeInstantiatedOnlyOncePerProcess:
            continue
        identity = (description.coSimulation.modelIdentifier, str(description.guid))
        if identity in first:
            raise CouplingError(
                f"{where}: components {first[identity]!r} and {name!r} are the same FMU ({path.name}), which can be "
                f"instantiated "
                "only once per process (canBeInstantiatedOnlyOncePerProcess). Ask its vendor for one without this "
                "limit."
            )
        first[identity] = name
