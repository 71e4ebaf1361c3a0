"""Warnings of many runs, each stated once with the runs that gave it. Works on texts only."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

_NUMBER = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?:[eE][+-]?\d+)?")
"""A number in a sentence; digits in the name of a component belong to that name."""
PAGE = "index.html"
"""Name of the page of many runs, which has all warnings."""
_MOST_LINES = 5
"""Warnings that a command prints of its runs; all are on the page."""


@dataclass(frozen=True)
class SharedWarning:
    """A warning that several runs gave in the same words, where only the numbers may differ.

    Args:
        text: the warning, as the first of these runs gave it.
        runs: the runs that gave it, by number or seed. count: runs in all.
    """

    text: str
    runs: Sequence[int]
    count: int

    def line(self, kind: str = "run") -> str:
        """How many runs gave it, one of them, and the warning.

        Args:
            kind: what the numbers in `runs` are, ``run`` or ``seed``.
        """
        return f"{len(self.runs)} of {self.count} {kind}s ({kind} {self.runs[0]}): {self.text}"

    def to_data(self) -> dict[str, Any]:
        """Plain data: ``text`` and ``runs``."""
        return {"text": self.text, "runs": list(self.runs)}


def shared_warnings(each: Mapping[int, Sequence[str]]) -> list[SharedWarning]:
    """The distinct warnings of many runs, in order of appearance.

    Args:
        each: the warnings of every run, by number or seed.
    """
    found: dict[str, SharedWarning] = {}
    for run, texts in each.items():
        for text in texts:
            known = found.setdefault(_NUMBER.sub("0", text), SharedWarning(text, (), len(each)))
            if run not in known.runs[-1:]:  # one run may give it several times, such as for several instants
                found[_NUMBER.sub("0", text)] = replace(known, runs=(*known.runs, run))
    return list(found.values())


def warning_lines(found: Sequence[SharedWarning], where: str, kind: str = "run") -> list[str]:
    """A line for each warning, the most common first, and where the others stand if there are many.

    Args:
        found: distinct warnings. where: the page or folder that has all. kind: as for `SharedWarning.line`.
    """
    lines = [one.line(kind) for one in sorted(found, key=lambda one: -len(one.runs))]
    more = [f"and {counted(len(lines) - _MOST_LINES, 'more ')}: see {where}"] if len(lines) > _MOST_LINES else []
    return [*lines[:_MOST_LINES], *more]


def counted(count: int, which: str = "") -> str:
    """A number of warnings in words, such as ``3 warnings``.

    Args:
        count: of warnings. which: stands before the word, with a space at its end.
    """
    return f"{count} {which}{'warning' if count == 1 else 'warnings'}"
