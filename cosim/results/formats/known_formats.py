"""The formats of result tables by name and by the ending of a file. Packages are loaded where they are used."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from cosim.errors import OutputError, nearest
from cosim.results.formats.format import Format
from plant_models.missing_package import installation, is_installed
from plant_models.registry import Registry, RegistryError

FORMATS: Registry[type[Format]] = Registry(
    "format", ("cosim.results.formats",), "cosim.formats", "cosim.results.formats.format:Format"
)


def usual_file(name: str) -> str:
    """Name of the table of a results folder in a format.

    Args:
        name: of the format.
    """
    return f"table{FORMATS[name].endings[0]}"


def fastest_first() -> list[type[Format]]:
    """All formats, those that are read soonest first; the log names one that cannot be loaded."""
    return sorted(FORMATS.usable().values(), key=lambda item: -item.speed)


def table_files() -> dict[str, str]:
    """Names of the table of a results folder, by format."""
    return {item.name: usual_file(item.name) for item in fastest_first()}


def check_formats(names: Iterable[str]) -> None:
    """Make sure, before a run, that these formats exist and that what they need is installed.

    Args:
        names: of the formats.

    Raises:
        OutputError: one does not, or lacks a package; the message says what to do.
    """
    for name in names:
        if name not in FORMATS:
            raise OutputError(f"Unknown result format {name!r}; {nearest(name, FORMATS)}")
        try:
            wanted = FORMATS[name]
        except RegistryError as error:
            raise OutputError(str(error)) from error
        if wanted.package is not None and not is_installed(wanted.package):
            install = installation(wanted.package)
            raise OutputError(
                f"The result format {name!r} needs the package {wanted.package}: {install}, or choose another format."
            )


def format_of(path: Path) -> type[Format]:
    """The format that the ending of a file name means.

    Args:
        path: the file.

    Raises:
        OutputError: none; the message lists the endings.
    """
    endings = {ending: item for item in fastest_first() for ending in item.endings}
    for ending in sorted(endings, key=len, reverse=True):
        if path.name.lower().endswith(ending):
            return endings[ending]
    raise OutputError(f"{path}: the format follows from the ending of the name, one of {', '.join(endings)}.")
