"""Names: what a system calls itself and its events becomes names in C and a file name, and must be legal there."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from importlib.resources import files
from pathlib import Path

from plant_models.hybrid import HybridSystem

_LEGAL = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
LONGEST = 63
"""Significant characters of a name in C11, 5.2.4.1."""

_C_KEYWORDS = frozenset(
    {
        "auto",
        "break",
        "case",
        "char",
        "const",
        "continue",
        "default",
        "do",
        "double",
        "else",
        "enum",
        "extern",
        "float",
        "for",
        "goto",
        "if",
        "inline",
        "int",
        "long",
        "register",
        "restrict",
        "return",
        "short",
        "signed",
        "sizeof",
        "static",
        "struct",
        "switch",
        "typedef",
        "union",
        "unsigned",
        "void",
        "volatile",
        "while",
    }
)


class NameRefusedError(ValueError):
    """A name that cannot stand in C or in a model description; the message says which and what is legal."""


def check_names(system: HybridSystem) -> None:
    """Refuse what Python allows as a name and C or FMI does not.

    Raises:
        NameRefusedError: the name of the system, of an event or of a signal is not legal.
    """
    where = f"{type(system).__name__} ({system.name!r})"
    for what, name in _names(system):
        if not _LEGAL.fullmatch(name):
            raise NameRefusedError(
                f"{where}: the name {name!r} of {what} is not legal in C and FMI; use a-z, A-Z, 0-9, '_'."
            )
        if len(name) > LONGEST:
            raise NameRefusedError(f"{where}: the name {name!r} of {what} is too long; {LONGEST} characters are legal.")
    if system.name in _C_KEYWORDS | _runtime_words():
        raise NameRefusedError(
            f"{where}: the name {system.name!r} is a word of C or of the runtime; choose another one."
        )


@cache
def _runtime_words() -> frozenset[str]:
    """The names of the runtime's files, with which its functions begin, and what else would meet them."""
    return frozenset({"casadi", "main", *(Path(entry.name).stem for entry in (files("fmus") / "runtime").iterdir())})


def _names(system: HybridSystem) -> Iterator[tuple[str, str]]:
    yield "the system", system.name
    yield from (("an event", event.name) for event in system.events)
    signals = (*system.states, *system.input_signals, *system.outputs, *system.parameter_signals)
    yield from (("a signal", signal.name) for signal in signals)
