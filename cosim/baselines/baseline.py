"""What a baseline is: a result that was found right, with what was run and how far later results may be from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cosim.baselines.model_identity import Identity
from cosim.baselines.recipe import Recipe
from cosim.comparison.tolerance import Tolerances
from cosim.results.result import Result, SignalInfo


@dataclass(frozen=True)
class Header:
    """All that a baseline says beside its numbers; the JSON file.

    Args:
        title: of the run, for people.
        recipe: what was run.
        span: ``start``, ``stop`` and ``step`` of the run [s].
        components: which models ran, by name.
        signals: what the columns are, by name.
        tolerances: how far a result may be from it.
        selection: patterns by which signals were chosen; None for all.
        every: least spacing of the rows that was asked for [s]; None where nothing was.
        rows: number of rows. events: number of telegrams, None where they are not known (a plain table).
        digest: of the rows, so that editing by hand is noticed.
        versions: of Python, the packages and the platform, as of the run.
        version: of the layout, ``major.minor``.
    """

    title: str
    recipe: Recipe
    span: Mapping[str, float]
    components: Sequence[Identity]
    signals: Sequence[SignalInfo]
    tolerances: Tolerances
    selection: Sequence[str] | None
    every: float | None
    rows: int
    events: int | None
    digest: str
    versions: Mapping[str, str]
    version: str


@dataclass(frozen=True)
class Baseline:
    """A baseline read from its files.

    Args:
        header: what it says of itself.
        result: its rows and telegrams.
        path: of the JSON file, or of the FMU it was found in.
        notes: what was odd and did not matter: edited by hand, written by a newer version.
        more: of one found in an FMU: its ``name``, and its inputs, the ``stimuli``, as the bytes of a table.
    """

    header: Header
    result: Result
    path: Path
    notes: Sequence[str] = ()
    more: Mapping[str, Any] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """What it is called in messages: the file, and the name where an FMU may hold several."""
        return f"{self.path.name}#{self.more['name']}" if "name" in self.more else self.path.name

    @property
    def tolerances(self) -> Tolerances:
        """How far a result may be from it."""
        return self.header.tolerances
