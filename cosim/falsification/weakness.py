"""What a falsification comes to, and its files: the run that breaks an expectation as a scenario that fails, and data.
Touches only the folder that it writes.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cosim.errors import OutputError
from cosim.falsification.margins import Margin
from cosim.studies.measures import setting_text
from fmus.tables.numbers import number
from fmus.tables.plain_data import jsonable
from fmus.tables.table import Parts, Readable, Table, name_column

if TYPE_CHECKING:
    from cosim.simulation.scenario import Scenario

WEAKNESS, _DATA = "weakness.toml", "falsified.json"
_REASONS, _COLUMNS = 3, ("nominal", "found", "smallest")


@dataclass(frozen=True)
class Falsification(Readable):
    """A search for a run that breaks an expectation.

    Args:
        scenario: that was searched. nominal: what it has of the settings that are varied, of those that are numbers.
        as_it_is: margin of the scenario without a change. worst: of the run that was found, the smallest of all.
        found: settings of that run. smallest: those that still break it, made few and small; empty where none does.
        margin: with them. searched: runs of the search. first: number of the first that breaks it, from 1, or None.
        shrunk: runs that made it small. failures: how many runs ended early, by reason.
    """

    scenario: Scenario
    nominal: Mapping[str, float]
    as_it_is: Margin
    worst: Margin
    found: Mapping[str, Any]
    smallest: Mapping[str, Any]
    margin: Margin
    searched: int
    first: int | None
    shrunk: int = 0
    failures: Mapping[str, int] = field(default_factory=dict)

    @property
    def broken(self) -> bool:
        """Whether a run that breaks an expectation was found."""
        return self.first is not None

    def parts(self) -> Parts:
        """What is changed, what was run, and what it comes to."""
        return [*self.details(), self.verdict]

    def details(self) -> Parts:
        """The same without the verdict."""
        rows = [[name, self.nominal.get(name), value, self.smallest.get(name)] for name, value in self.found.items()]
        headings = ("the scenario has", "found with", "still breaks with")
        columns = [
            name_column("name", "setting"),
            *(name_column(k, h, write=_cell) for k, h in zip(_COLUMNS, headings, strict=True)),
        ]
        title = "The run that breaks it" if self.broken else "The run that comes nearest"
        return [Table("changes", columns, rows, title), "\n".join(self._runs())]

    def _runs(self) -> list[str]:
        """What was run, and what failed."""
        first = f", the first that breaks an expectation is number {self.first}" if self.broken else ""
        lines = [f"{self.searched} runs searched{first}; margin without any change {number(self.as_it_is.value)}."]
        if self.broken:
            lines.append(f"{self.shrunk} more runs made it small: {len(self.smallest)} of {len(self.found)} changes.")
        ordered = sorted(self.failures.items(), key=lambda entry: -entry[1])
        shown = [f"{count} ended early: {reason.splitlines()[0]}" for reason, count in ordered[:_REASONS]]
        return lines + shown + [f"... and {len(ordered) - _REASONS} other reasons"] * (len(ordered) > _REASONS)

    @property
    def verdict(self) -> str:
        """What it comes to, in a sentence or two."""
        shown = (self.margin if self.broken else self.worst).evaluated
        if shown is None:
            return f"None of {self.searched} runs shows an expectation: all ended early."
        what = f"expectation {shown.number}, {shown.name}"
        if self.broken:
            changed = ", ".join(f"{name} = {setting_text(value)}" for name, value in self.smallest.items())
            return f"Broken: {what}: {shown.text}, with {changed or 'no change at all'}."
        return (
            f"Not broken in {self.searched} runs: nearest is {what}: {shown.text} (margin {number(self.worst.value)}). "
            "A search shows what it finds, and not how rare the rest is."
        )

    def to_data(self) -> dict[str, Any]:
        """Plain data."""
        margins = {"as_it_is": self.as_it_is.value, "worst": self.worst.value, "smallest": self.margin.value}
        expectation = (self.margin if self.broken else self.worst).evaluated
        return {
            "broken": self.broken,
            "expectation": None if expectation is None else expectation.to_data(),
            "margins": margins,
            "nominal": dict(self.nominal),
            "found": dict(self.found),
            "smallest": dict(self.smallest),
            "searched": self.searched,
            "first": self.first,
            "shrunk": self.shrunk,
            "failures": dict(self.failures),
        }

    def write(self, directory: Path) -> dict[str, Path]:
        """Write the scenario that fails, where there is one, and the data.

        Args:
            directory: the folder, which is there.

        Returns:
            Paths by kind: ``weakness``, ``data``.

        Raises:
            OutputError: they cannot be written.
        """
        paths = {"data": directory / _DATA}
        try:
            (directory / WEAKNESS).unlink(missing_ok=True)
            if self.broken:
                paths["weakness"] = self.scenario.with_settings(self.smallest).save(directory / WEAKNESS)
                text = f"# {self.verdict}\n{paths['weakness'].read_text(encoding='utf-8')}"
                paths["weakness"].write_text(text, encoding="utf-8", newline="\n")
            data = json.dumps(jsonable(self.to_data()), indent=2, allow_nan=False) + "\n"
            paths["data"].write_text(data, encoding="utf-8")
        except OSError as error:
            raise OutputError(f"{directory} cannot be written: {error.strerror or error}.") from error
        return paths


def _cell(value: Any) -> str:
    return "" if value is None else setting_text(value)
