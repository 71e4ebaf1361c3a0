"""What a command reports, as a value, and the one place that shows it: as text, or as JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fmus.cli.colour import Role, coloured
from fmus.cli.parsers import print_error
from fmus.plain import plain
from fmus.tables.plain_data import jsonable
from fmus.tables.table import Parts, Table, joined
from fmus.tables.terminal import PIPED, terminal_width


@dataclass(frozen=True)
class Output:
    """What a command reports.

    Attributes:
        parts: for people.
        data: for programs. A mapping also gets each table of `parts` that it does not hold, under its key, and `files`;
            None for the tables, and the texts of `parts` under ``text``.
        files: what was written, by kind. code: exit code. failures: texts for standard error.
        verdict: what it comes to, in a sentence, which is printed last; in data where that has no verdict of its own.
            role: what the verdict is.
        error: what ended the command although there is something to show; raised when that has been shown.
    """

    parts: Parts = ()
    data: Any = None
    files: Mapping[str, Path] = field(default_factory=dict)
    code: int = 0
    failures: Sequence[str] = ()
    error: BaseException | None = None
    verdict: str = ""
    role: Role = "good"

    def to_data(self) -> Any:
        """All of it for programs, ready for JSON."""
        data = {"text": [part for part in self.parts if isinstance(part, str)]} if self.data is None else self.data
        if isinstance(data, Mapping):
            data = {part.key: part.data() for part in self.parts if isinstance(part, Table)} | dict(data)
            data |= {"files": self.files} if self.files else {}
            data = ({"verdict": self.verdict} if self.verdict else {}) | data
        return jsonable(data)

    def text(self, width: int | None = None) -> str:
        """All of it for people, a blank line between the parts.

        Args:
            width: of the terminal, which is not exceeded; None for a file or a pipe, where a row is a line.
        """
        files = "\n".join(f"{kind:>10}: {path}" for kind, path in self.files.items())
        how = "see --json or the page" if {"page", "report"} & set(self.files) else "see --json"
        parts = [part.within(PIPED, how) if width is None and isinstance(part, Table) else part for part in self.parts]
        return joined([*parts, files, self.verdict], width)

    def show(self, program: str, *, as_json: bool) -> int:
        """Print it; nothing but JSON goes to standard output where that was asked for.

        Args:
            program: its name, before failures. as_json: whether JSON was asked for.

        Returns:
            The exit code.
        """
        text = json.dumps(self.to_data(), indent=2, allow_nan=False) if as_json else plain(self.text(terminal_width()))
        if self.verdict and not as_json:
            end = plain(joined([self.verdict], terminal_width()))
            text = text.removesuffix(end) + coloured(end, self.role)
        if text:
            _print(text)
        for failure in self.failures:
            print_error(program, failure)
        if self.error is not None:
            raise self.error
        return self.code


class UnwritableError(OSError):
    """Standard output takes no more: it is a file on a full disk, say."""


def _print(text: str) -> None:
    """Print to standard output, at once.

    Raises:
        BrokenPipeError: nobody reads any more. UnwritableError: it cannot be written for another reason.
    """
    try:
        print(text, flush=True)
    except BrokenPipeError:
        raise
    except OSError as error:
        raise UnwritableError(f"standard output cannot be written: {error.strerror or error}.") from error
