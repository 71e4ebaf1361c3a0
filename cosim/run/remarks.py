"""Warnings and notes of a run, in the order in which its steps find them; handed to every step that finds some."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Remarks:
    """What the user should know of a run.

    Args:
        report: called with each warning as soon as it is found. warnings: reported so far. notes: what only explains.
    """

    report: Callable[[str], None]
    warnings: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def warn(self, *texts: str) -> None:
        """Report warnings, and keep them.

        Args:
            texts: a sentence or two each.
        """
        for text in texts:
            self.warnings.append(text)
            self.report(text)

    def note(self, *texts: str) -> None:
        """Keep what explains and does not warn.

        Args:
            texts: a sentence or two each.
        """
        self.notes.extend(texts)
