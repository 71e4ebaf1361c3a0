"""What was run, so that it can be run again: an FMU alone, or a scenario. Plain data; paths are relative to the
baseline.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path, PureWindowsPath
from typing import Any, Literal

from cosim.components.recording_data import Chosen
from cosim.errors import BaselineError

Kind = Literal["fmu", "scenario", "result"]
KINDS = ("fmu", "scenario", "result")


@dataclass(frozen=True)
class Recipe:
    """What was run.

    Args:
        kind: ``fmu`` alone, ``scenario``, or ``result``: something else, which cannot be run again from here.
        source: path of the FMU or of the scenario file (absolute here, relative in a file), or name of a shipped
            scenario. start, stop, step: of an FMU alone [s]; None for its own default experiment.
        inputs: of an FMU alone: constants by name, or path of a table.
        parameters: start values by name, of an FMU alone.
        record: variables recorded besides the outputs, of an FMU alone.
        overrides: of a scenario, as for `Scenario.set`.
        interpolation: whether columns of the table are held or run on lines, of all or of some by name.
        units: what is stated of the variables of an FMU alone, by name.
    """

    kind: Kind = "result"
    source: str = ""
    start: float | None = None
    stop: float | None = None
    step: float | None = None
    inputs: Mapping[str, Any] | str = field(default_factory=dict)
    parameters: Mapping[str, Any] = field(default_factory=dict)
    record: Sequence[str] = ()
    overrides: Mapping[str, Any] = field(default_factory=dict)
    interpolation: Chosen = None
    units: Mapping[str, Any] = field(default_factory=dict)

    def to_data(self, folder: Path) -> dict[str, Any]:
        """Plain data for a file in `folder`."""
        data: dict[str, Any] = {"kind": self.kind}
        if self.source:
            data["source"] = _relative(self.source, folder)
        data |= {key: value for key in ("start", "stop", "step") if (value := getattr(self, key)) is not None}
        for key in ("inputs", "parameters", "overrides", "units"):
            value = getattr(self, key)
            if value:
                data[key] = _relative(value, folder) if isinstance(value, str) else dict(value)
        if self.interpolation is not None:
            data["interpolation"] = self.interpolation
        return data | ({"record": list(self.record)} if self.record else {})

    @classmethod
    def from_data(cls, data: Mapping[str, Any], folder: Path) -> Recipe:
        """The recipe that `to_data` wrote into a file in `folder`.

        Args:
            data: plain data, as from a JSON file.

        Raises:
            BaselineError: it is none.
        """
        known = {entry.name for entry in fields(cls)}
        entries = {key: value for key, value in data.items() if key in known}
        if entries.get("kind") not in KINDS:
            raise BaselineError(f"run.kind is {entries.get('kind')!r}; expected one of {', '.join(KINDS)}.")
        recipe = cls(**entries)
        if isinstance(recipe.inputs, str):
            recipe = replace(recipe, inputs=_absolute(recipe.inputs, folder))
        return replace(recipe, source=_absolute(recipe.source, folder))

    def of(self, fmu: str | Path) -> Recipe:
        """The same with another FMU.

        Args:
            fmu: its path.

        Raises:
            BaselineError: it is not an FMU alone.
        """
        if self.kind != "fmu":
            raise BaselineError(
                "Another FMU can be put in place of an FMU alone only; this baseline is of a scenario or a result."
            )
        return replace(self, source=str(Path(fmu).resolve()))


def _relative(path: str, folder: Path) -> str:
    """A path as seen from a folder, with forward slashes; names of shipped scenarios stay as they are."""
    if not Path(path).is_absolute():
        return path
    try:
        return Path(os.path.relpath(path, folder.resolve())).as_posix()
    except ValueError:  # another drive of Windows
        return PureWindowsPath(path).name


def _absolute(path: str, folder: Path) -> str:
    """The path that `_relative` wrote; what leads to no file is left as it is (the name of a shipped scenario)."""
    if "/" not in path and "." not in path:
        return path
    return str((folder / path).resolve())
