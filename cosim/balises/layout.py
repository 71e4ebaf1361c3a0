"""Layouts: where the balises lie on the track, or at which instants a test places one under the train.

Knows besides only what a telegram may state.
"""

from __future__ import annotations

import csv
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from math import inf
from pathlib import Path

import numpy as np

from cosim.errors import ScenarioError
from cosim.results.record_rows import require_accuracy
from plant_models.repeated_names import repeated_names


@dataclass(frozen=True, slots=True)
class Balise:
    """A balise on the track: identity, position [m], location accuracy Q_LOCACC [m]."""

    identity: str
    position: float
    location_accuracy: float = 0.0


@dataclass(frozen=True)
class TrackLayout:
    """Balises by position, in increasing order.

    Args:
        balises: at least one.
    """

    balises: tuple[Balise, ...]
    positions: np.ndarray = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        positions = np.array([b.position for b in self.balises])
        if not len(positions):
            raise ScenarioError("A balise layout needs at least one balise.")
        if np.any(~np.isfinite(positions)):
            raise ScenarioError("A balise position is not a finite number.")
        steps = np.diff(positions)
        if np.any(steps <= 0.0):
            i = int(np.argmax(steps <= 0.0))
            raise ScenarioError(
                f"Balises must be listed in increasing position, one at a place: number {i + 2} at "
                f"{positions[i + 1]:g} m "
                f"follows number {i + 1} at {positions[i]:g} m."
            )
        self._check_balises()
        object.__setattr__(self, "positions", positions)

    def _check_balises(self) -> None:
        if twice := repeated_names(b.identity for b in self.balises):
            raise ScenarioError(
                f"Every balise needs an identity of its own; used more than once: {', '.join(twice[:5])}."
            )
        for b in self.balises:
            if not 0.0 <= b.location_accuracy < inf:
                raise ScenarioError(
                    f"Balise {b.identity!r}: location accuracy must not be negative, got {b.location_accuracy!r} m."
                )

    def crossed(self, before: float, after: float) -> list[Balise]:
        """Balises passed between two positions [m], in the order of crossing: in ``(before, after]`` or
        ``[after, before)``.
        """
        if after >= before:
            first, last = self.positions.searchsorted([before, after], side="right")
            return list(self.balises[first:last])
        first, last = self.positions.searchsorted([after, before], side="left")
        return list(reversed(self.balises[first:last]))

    def gaps(self, position: float) -> tuple[float, float]:
        """Distances [m] to the nearest balise behind and ahead of a position [m], infinite where there is none; one
        exactly there is passed already and counts for neither."""
        behind = int(self.positions.searchsorted(position, side="left")) - 1
        ahead = int(self.positions.searchsorted(position, side="right"))
        return (
            position - float(self.positions[behind]) if behind >= 0 else inf,
            float(self.positions[ahead]) - position if ahead < len(self.positions) else inf,
        )

    def nearest(self, position: float) -> Balise:
        """The balise nearest to a position [m]."""
        return self.balises[int(np.argmin(np.abs(self.positions - position)))]

    def check_within(self, start: float, end: float) -> None:
        """Refuse balises outside the track.

        Raises:
            ScenarioError: one lies before `start` or behind `end` [m].
        """
        outside = [b for b in self.balises if not start <= b.position <= end]
        if outside:
            b = outside[0]
            raise ScenarioError(
                f"Balise {b.identity!r} at {b.position:g} m lies outside the track from {start:g} m to {end:g} m."
            )


@dataclass(frozen=True)
class InstantLayout:
    """Balises that a test places under the train at given instants [s]; their positions come out of the run."""

    instants: np.ndarray
    _sorted: list[float] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_sorted", self.instants.tolist())
        if np.any(~np.isfinite(self.instants)):
            raise ScenarioError("Balise instants must be finite and increasing; one is not finite.")
        late = np.flatnonzero(np.diff(self.instants) <= 0.0)
        if late.size:
            i = int(late[0])
            raise ScenarioError(
                f"Balise instants must be finite and increasing: number {i + 2} at {self.instants[i + 1]:g} s follows "
                f"number "
                f"{i + 1} at {self.instants[i]:g} s."
            )

    def within(self, t: float, until: float) -> list[float]:
        """Instants in ``(t, until]`` [s]."""
        first = bisect_right(self._sorted, t)
        return self._sorted[first : bisect_right(self._sorted, until, first)]

    def identity(self, instant: float) -> str:
        """Name of the balise at one of the instants [s]: ``I1`` for the first.

        Args:
            instant: of the crossing [s].
        """
        return f"I{bisect_left(self._sorted, instant) + 1}"


Layout = TrackLayout | InstantLayout


MOST_BALISES = 1e6
"""Of a layout by spacing: every metre of a thousand kilometres; more takes gigabytes, and looks like a hang."""


def by_spacing(spacing: float, first: float, last: float, location_accuracy: float = 0.0) -> TrackLayout:
    """Balises every `spacing` metres from `first` to `last` [m].

    Args:
        location_accuracy: Q_LOCACC [m].

    Raises:
        ScenarioError: the spacing is not positive, or there is no balise, or more than `MOST_BALISES`.
    """
    if not spacing > 0.0:
        raise ScenarioError(f"Balise spacing must be positive, got {spacing!r} m.")
    intervals = (last - first) / spacing + 1e-9
    if not intervals < MOST_BALISES:
        raise ScenarioError(
            f"Balises every {spacing:g} m from {first:g} m to {last:g} m are more than {MOST_BALISES:.0e}; a track_end "
            "beyond the reach of the train is of no use."
        )
    count = int(np.floor(intervals)) + 1
    if count < 1:
        raise ScenarioError(f"No balise between {first:g} m and {last:g} m.")
    return TrackLayout(tuple(Balise(f"B{i + 1}", first + i * spacing, location_accuracy) for i in range(count)))


def by_positions(positions: Sequence[float], location_accuracy: float = 0.0) -> TrackLayout:
    """Balises at the given positions [m], in increasing order.

    Args:
        location_accuracy: Q_LOCACC [m].
    """
    return TrackLayout(tuple(Balise(f"B{i + 1}", float(p), location_accuracy) for i, p in enumerate(positions)))


def from_csv(path: str | Path, location_accuracy: float = 0.0) -> TrackLayout:
    """Balises from a CSV file with a header: ``position`` [m], optional ``identity`` and ``location_accuracy`` [m].

    Other columns are left alone, and so are lines that begin with ``#``: source and licence of the positions.

    Args:
        path: of the file. location_accuracy: Q_LOCACC [m] of balises for which the file states none.

    Raises:
        ScenarioError: the file is missing, has no such column, or a row cannot be read; the row is named.
    """
    path = Path(path)
    if not path.is_file():
        raise ScenarioError(f"Balise list {path} does not exist.")
    try:
        with path.open(newline="", encoding="utf-8-sig") as stream:  # spreadsheets write a byte order mark
            # a line that is left out still counts: messages name lines of the file
            lines = [(number, line) for number, line in enumerate(stream, start=1) if not line.startswith("#")]
            reader = csv.DictReader((line for _, line in lines), skipinitialspace=True)
            if "position" not in (reader.fieldnames or []):
                raise ScenarioError(f"Balise list {path}: no column 'position' in the header {reader.fieldnames}.")
            balises = [
                _row_to_balise(path, number, lines[reader.line_num - 1][0], row, location_accuracy)
                for number, row in enumerate(reader, start=1)
            ]
    except (UnicodeDecodeError, csv.Error, OSError) as error:
        raise ScenarioError(f"Balise list {path} cannot be read: {error}.") from error
    try:
        return TrackLayout(tuple(balises))
    except ScenarioError as error:
        raise ScenarioError(f"Balise list {path}: {error}") from error


def aperiodic(
    until: float,
    seed: int,
    *,
    min_gap: float = 0.1,
    max_gap: float = 0.5,
    dropout_after: float = 7.9,
    dropout_fraction: float = 0.15,
    dropout_stretch: float = 2.5,
    start: float = 0.0,
) -> InstantLayout:
    """Aperiodic instants as in the simulations of Bouchama 2024, figure 3.10 (the figure's own data are not published).

    Gaps are uniform in [`min_gap`, `max_gap`]; after `dropout_after` a fraction of them is stretched by a factor
    uniform in [1.2, `dropout_stretch`].

    Args:
        until: last instant at most [s].
        seed: seed of the pattern.
        min_gap, max_gap: range of the regular gaps [s].
        dropout_after: drop-outs occur after this time [s].
        dropout_fraction: share of stretched gaps.
        dropout_stretch: largest factor of a stretched gap.
        start: the first gap begins here [s].

    Raises:
        ScenarioError: the gaps are not positive or not in order.
    """
    if not 0.0 < min_gap <= max_gap:
        raise ScenarioError(f"Balise gaps need 0 < min_gap <= max_gap, got {min_gap!r} s and {max_gap!r} s.")
    generator = np.random.Generator(np.random.Philox(seed))
    instants: list[float] = []
    t = start
    while True:
        gap = generator.uniform(min_gap, max_gap)
        dropped, factor = generator.uniform() < dropout_fraction, generator.uniform(1.2, max(dropout_stretch, 1.2))
        t += gap * (factor if dropped and t > dropout_after else 1.0)
        if t > until:
            return InstantLayout(np.array(instants))
        instants.append(t)


def _row_to_balise(path: Path, number: int, line: int, row: dict[str, str], usual: float) -> Balise:
    try:
        accuracy = float(row.get("location_accuracy") or usual)
        require_accuracy(accuracy)
        return Balise(row.get("identity") or f"B{number}", float(row["position"]), accuracy)
    except (TypeError, ValueError) as error:
        raise ScenarioError(f"Balise list {path}, line {line}: {error}.") from error
