"""Report: what an FMU file says about itself, as data and as tables. Works with any FMU, ours or a vendor's; reads,
never runs.
"""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fmpy.model_description import ModelDescription, ModelVariable
from fmpy.validation import validate_fmu

from fmus.fmi.archive import Archive
from fmus.fmi.binaries import LIBRARY_SUFFIXES
from fmus.fmi.capabilities import HELD_AS
from fmus.fmi.description import read_description
from fmus.fmi.standard import INTERFACES, fmi_version
from fmus.fmi.types import enumeration_items
from fmus.tables.table import Parts, Table, name_column, pairs_table, text_column
from fmus.toolchain.machine_code import platforms_of_library
from fmus.toolchain.platforms import host_platform

_CAPABILITIES = (
    "canHandleVariableCommunicationStepSize",
    "canGetAndSetFMUstate",
    "canSerializeFMUstate",
    "hasEventMode",
    "mightReturnEarlyFromDoStep",
    "providesDirectionalDerivative",
    "completedIntegratorStepNotNeeded",
)
_FOLDERS = {
    "linux32": {"x86-linux"},
    "linux64": {"x86_64-linux", "aarch64-linux"},  # many importers look there on any 64-bit processor
    "win32": {"x86-windows"},
    "win64": {"x86_64-windows"},
    "darwin64": {"x86_64-darwin", "aarch64-darwin"},
}
"""What may lie in a folder named as in FMI 2.0; all others are platform tuples."""
LARGEST = 2_000_000_000
_HEADER_SIZE = 4096


_COLUMNS = (
    name_column("name"),
    text_column("start", write=lambda value: "" if value is None else f"= {value}"),
    text_column("unit", write=lambda unit: f"[{unit or '-'}]"),
    *(text_column(key) for key in ("type", "variability", "description")),
)


def describe_file(path: Path, description: ModelDescription | None = None) -> dict[str, Any]:
    """What an FMU says of itself, as plain data: version, interfaces, capabilities, platforms, variables.

    Args:
        path: an FMU file. description: what is taken for its own one, where that is known already.

    Raises:
        ValueError: the file is not an FMU.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            platforms, names = _platforms(archive), archive.namelist()
        description = description or read_description(path)
    except Exception as error:
        raise ValueError(f"{path} cannot be read as an FMU: {_reason(error)}") from error
    return {
        "file": str(path),
        "model": description.modelName,
        "description": description.description or "",
        "FMI version": description.fmiVersion,
        "interfaces": [text for name, text in INTERFACES.items() if getattr(description, name) is not None],
        "tool": description.generationTool or "",
        "platforms": platforms,
        f"this machine ({host_platform().name})": _on_this_machine(Archive(path, description, tuple(names))),
        **_capabilities(description),
        "variables": [_variable(v) for v in description.modelVariables],
    }


def description_parts(data: Mapping[str, Any]) -> Parts:
    """A description for people: its properties, then the variables by their causality.

    Args:
        data: from `describe_file`, or with the same keys for variables.
    """
    tables: list[Table | str] = []
    for causality in ("input", "output", "parameter", "local"):
        chosen = [v for v in data["variables"] if v["causality"] == causality]
        title = f"{causality}s ({len(chosen)}):"
        rows = [[v[column.key] for column in _COLUMNS] for v in chosen]
        tables.append(Table("variables", _COLUMNS, rows, title).filled() if rows else title)
    return [pairs_table("properties", {k: v for k, v in data.items() if k != "variables"}), *tables]


def problems_of(path: Path) -> list[str]:
    """Damaged files, libraries in the wrong folder, and what fmpy's validation finds; empty for a valid FMU.

    Args:
        path: of the FMU.
    """
    with zipfile.ZipFile(path) as archive:
        problems = [*_damage(archive), *_strays(archive)]
    return problems + list(validate_fmu(str(path)))


def _platforms(archive: zipfile.ZipFile) -> list[str]:
    return sorted({name.split("/")[1] for name in _libraries(archive)})


def _libraries(archive: zipfile.ZipFile) -> list[str]:
    names = (entry.filename for entry in archive.infolist() if not entry.is_dir())
    return [
        name
        for name in names
        if name.startswith("binaries/") and name.count("/") == 2 and name.endswith(LIBRARY_SUFFIXES)
    ]


def _on_this_machine(archive: Archive) -> str:
    reason = archive.why_not_here()
    if reason:
        return f"no, it {reason}"
    return "yes" if archive.here else "yes, by a library that was compiled of its sources here"


def _damage(archive: zipfile.ZipFile) -> list[str]:
    if sum(entry.file_size for entry in archive.infolist()) > LARGEST:
        return [f"It unpacks to more than {LARGEST / 1e9:g} GB; its content was not checked."]
    try:
        broken = archive.testzip()
    except Exception as error:  # zlib's own, a wrong header, an unknown compression
        return [f"The archive is damaged: {_reason(error)}"]
    return [f"The archive is damaged: {broken} has a wrong check sum."] if broken else []


def _strays(archive: zipfile.ZipFile) -> list[str]:
    """Libraries that were built for another platform than their folder says."""
    problems = []
    for name in _libraries(archive):
        folder = name.split("/")[1]
        expected = _FOLDERS.get(folder, {folder})
        try:
            with archive.open(name) as stream:
                found = platforms_of_library(stream.read(_HEADER_SIZE))
        except Exception:
            continue  # reported as damage
        if not expected & set(found):
            problems.append(f"{name} is a library for {', '.join(found)}, not for {' or '.join(sorted(expected))}.")
    return problems


def _reason(error: Exception) -> str:
    return str(error) or type(error).__name__


def _capabilities(description: ModelDescription) -> dict[str, Any]:
    """Those of each interface, in the words of the FMI version."""
    known = {held: name for name, held in HELD_AS.items()} if fmi_version(description) == 3 else {}
    found = {}
    for held, text in INTERFACES.items():
        interface = getattr(description, held)
        if interface is not None:
            declared = [name for name in _CAPABILITIES if getattr(interface, name, False)]
            found[f"capabilities in {text}"] = [known.get(name, name) for name in declared]
    return found


def _variable(variable: ModelVariable) -> dict[str, Any]:
    """A variable; of an enumeration the names of its items stand for their numbers."""
    items = {str(number): item for item, number in enumeration_items(variable).items()}
    return {
        "name": variable.name,
        "causality": variable.causality or "local",
        "variability": variable.variability,
        "type": f"{variable.type} ({', '.join(items.values())})" if items else variable.type,
        "unit": variable.unit,
        "start": items.get(str(variable.start), variable.start),
        "description": variable.description or "",
    }
