"""Saving: a scenario as the text of a scenario file, complete in itself. Touches the file it is given, and FMUs out of
packages.

Included files and overrides are already in the tables; what was never given is not written, so that defaults stay
defaults.
"""

from __future__ import annotations

import shutil
import tomllib
from pathlib import Path

import tomli_w

from cosim.errors import OutputError, ScenarioError
from cosim.scenario.paths import map_paths, relative
from cosim.scenario.schema import ScenarioTable
from cosim.scenario.toml_values import plain


def scenario_text(table: ScenarioTable, folder: Path, target: Path | None = None) -> str:
    """A scenario as the text of a scenario file.

    Args:
        table: the validated scenario. folder: start of its relative paths.
        target: folder that the paths in the text are to be relative to; None to leave them as they are.

    Returns:
        TOML, which reads back to the identical values.
    """
    data = plain(table.model_dump(by_alias=True, exclude_unset=True))
    if target is not None:
        data = map_paths(data, lambda path: relative(folder / path, target))
    text = tomli_w.dumps(data, multiline_strings=True)
    return text if tomllib.loads(text) == data else tomli_w.dumps(data)


def save_scenario(table: ScenarioTable, folder: Path, path: Path, unpacked: Path | None = None) -> Path:
    """Write a scenario file.

    Args:
        table: the validated scenario. folder: start of its relative paths. path: of the file, ending in ``.toml``.
        unpacked: a folder that lasts no longer than this process; files in it are copied to ``NAME_files`` beside the
            new file.

    Returns:
        The path.

    Raises:
        ScenarioError: the path does not end in ``.toml``.
        OutputError: the file cannot be written.
    """
    if path.suffix != ".toml":
        raise ScenarioError(f"{path}: a scenario is saved to a file that ends in .toml (export_ssp writes an .ssp).")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        text = scenario_text(_with_files(table, folder, path, unpacked), folder, path.parent)
        path.write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        raise OutputError(f"The scenario cannot be written to {path}: {error.strerror or error}.") from error
    return path


def _with_files(table: ScenarioTable, folder: Path, path: Path, unpacked: Path | None) -> ScenarioTable:
    """The scenario with the files of a package copied beside the new file."""
    if unpacked is None:
        return table
    beside = path.parent.resolve() / f"{path.stem}_files"

    def keep(stated: str) -> str:
        place = (folder / stated).resolve()
        if not place.is_relative_to(unpacked.resolve()):
            return stated
        copy = beside / "_".join(place.relative_to(unpacked.resolve()).parts)
        beside.mkdir(exist_ok=True)
        return str(shutil.copyfile(place, copy))

    return ScenarioTable.model_validate(map_paths(table.model_dump(by_alias=True, exclude_unset=True), keep))
