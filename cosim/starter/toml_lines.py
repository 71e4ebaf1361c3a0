"""Lines of a starter scenario: values, keys, comments and connections as TOML. Texts of vendors cannot leave their
line.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import Any

import tomli_w

from cosim.starter.guessed_signal import Guess, GuessedSignal
from fmus.tables.table import pairs_table

WIDTH = 118
_PLAIN_NAME = re.compile(r"[A-Za-z_][\w.]*(\[\d+(,\d+)*\])?", re.ASCII)
LISTED = 40
"""Variables of a kind that are listed; `cosim info` shows all."""


def entry(key: str, value: Any) -> str:
    """``key = value`` as TOML on one line.

    Args:
        key: its name.
        value: number, text, list or table.
    """
    name, _, _ = tomli_w.dumps({key: 0}).rpartition(" = ")
    return f"{name} = {inline(value)}"


def inline(value: Any) -> str:
    """A value as TOML on one line.

    Args:
        value: number, text, list or table.
    """
    if isinstance(value, dict):
        return "{ " + ", ".join(entry(str(k), v) for k, v in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(inline, value)) + "]"
    return tomli_w.dumps({"x": value}).removeprefix("x = ").rstrip("\n")


def one_line(text: str, length: int = 90) -> str:
    """A vendor's text fit for a comment: on one line, without control characters, not too long.

    Args:
        text: the text.
        length: of the text at most.
    """
    clean = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return clean if len(clean) <= length else clean[: length - 3] + "..."


def comment(text: str) -> str:
    """A paragraph as lines of comment.

    Args:
        text: the text.
    """
    return "\n".join(f"# {line}" for line in wrap(text, WIDTH))


def guessed(guess: Guess) -> str:
    """What is to be said behind a line that was guessed.

    Args:
        guess: a signal with why it was chosen.
    """
    others = f"; else {', '.join(map(one_line, guess.others))}" if guess.others else ""
    mark = "" if guess.sureness == "sure" else "PLEASE CHECK, "
    return f"  # {mark}{guess.sureness}: {one_line(guess.reason)}{others}"


def listing(title: str, signals: Sequence[GuessedSignal]) -> str:
    """Variables with unit and description, as comment.

    Args:
        title: what they are.
        signals: the variables.
    """
    units = {one_line(s.name): f"[{one_line(s.unit or '-')}]  {one_line(s.description)}" for s in signals[:LISTED]}
    table = pairs_table("signals", units).text()
    lines = [f"# {title} ({len(signals)}):", *(f"#   {line}" for line in table.splitlines())]
    more = len(signals) - LISTED
    return "\n".join(lines + ([f"#   ... and {more} more, see: cosim info"] if more > 0 else []))


@dataclass(frozen=True)
class GuessedLink:
    """A connection to be written.

    Args:
        source, targets: as ``component.signal``. remark: behind it. factor: where the number changes on its way.
    """

    source: str
    targets: Sequence[str]
    remark: str = ""
    factor: float | None = None

    def lines(self) -> list[str]:
        """Lines within the list of connections."""
        names = (self.source, *self.targets)
        if self.factor is None and all(_PLAIN_NAME.fullmatch(name.partition(".")[2]) for name in names):
            text = f"{self.source} -> {', '.join(self.targets)}"
            return [f"{inline(text)},{self.remark}"]
        changed = {} if self.factor is None else {"factor": self.factor, "units": "ignore"}
        return [f"{inline({'from': self.source, 'to': to} | changed)},{self.remark}" for to in self.targets]
