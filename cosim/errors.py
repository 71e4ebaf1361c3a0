"""Errors a user can meet, each with the place where it happened and what to do. Standard library only."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path

ALIKE = 0.65
"""Share of letters, as difflib counts them, from which on two names are near: below it, a hint leads astray."""
MOST_HINTS = 3
SHORTEST_PART = 3
"""Letters from which on a part of a name is a hint."""


class CosimError(Exception):
    """Base of all errors that are explained to the user without a traceback."""


class ScenarioError(CosimError, ValueError):
    """A scenario file or a scenario script says something that cannot be."""


class FmuLoadError(CosimError, OSError):
    """An FMU cannot be opened: missing, broken, or built for another platform."""


class CouplingError(CosimError, ValueError):
    """Components cannot be connected as asked: unknown variables, units, two sources, loops."""


class OutputError(CosimError, OSError):
    """Results cannot be written where asked."""


class ComparisonError(CosimError, ValueError):
    """Results cannot be compared as asked: tolerances that cannot be, nothing in common, an empty run."""


class BaselineError(CosimError, ValueError):
    """A baseline is missing, unreadable, or belongs to something else."""


class ProvenanceError(CosimError, ValueError):
    """A results folder does not say how it was made, or its files are not those any more."""


class UntrustedError(ProvenanceError):
    """Results would run code that was never run here.

    Attributes:
        files: of that code.
    """

    files: tuple[Path, ...] = ()


class CertificateError(CosimError, ValueError):
    """A scenario requires certificates and an observer's gaps exceed its own."""


class UnmetError(CosimError, AssertionError):
    """A run is not as its scenario expects it to be, or ended early."""


class RunError(CosimError, RuntimeError):
    """A component failed during the run.

    Args:
        reason: what happened and what to do.
        component: name of the component. time: communication point at which it happened [s].
    """

    def __init__(self, reason: str, component: str = "", time: float = float("nan")) -> None:
        super().__init__(reason)
        self.component, self.time = component, time


def not_utf8(data: bytes) -> str:
    """Which line is the first that is no UTF-8, in words.

    Args:
        data: that could not be decoded.
    """
    line = next((k for k, part in enumerate(data.split(b"\n"), 1) if part.decode(errors="ignore").encode() != part), 1)
    return f"line {line} is not UTF-8"


def nearest(name: str, known: Iterable[str]) -> str:
    """A hint with the names nearest to a misspelt one, or all of them, 20 at most, where none is near.

    Near is a name of which most letters stand in the same order, or that holds the given one whole.

    Args:
        name: as it was given. known: names that exist.
    """
    names = list(known)
    close = get_close_matches(name, names, MOST_HINTS, ALIKE)
    if not close and len(name) >= SHORTEST_PART:
        close = [n for n in names if name.lower() in n.lower()][:MOST_HINTS]
    if close:
        return f"did you mean {', '.join(repr(n) for n in close)}?"
    shown = ", ".join(names[:20]) + (f", and {len(names) - 20} more" if len(names) > 20 else "")
    return f"known: {shown or 'none'}."
