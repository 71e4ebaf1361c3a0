"""Recorded telegrams: what an earlier run received, sent again, whatever the plant does now. Touches only the file it
reads.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields, replace
from math import nan
from pathlib import Path
from typing import Any

import numpy as np

from cosim.balises.layout import InstantLayout
from cosim.balises.localiser import Localiser, Method
from cosim.balises.plant_monitor import PlantMonitor
from cosim.balises.telegram import NO_OUTCOMES, Channel, Crossing
from cosim.components.recording import RecordingComponent
from cosim.errors import OutputError, ScenarioError, nearest
from cosim.results.formats.csv_dialect import csv_dialect
from cosim.results.formats.headings import split_unit
from cosim.results.load_result import load_result
from cosim.results.read_once import read_once
from cosim.results.record_rows import TELEGRAM_ROWS, TELEGRAM_UNITS, parse_outcomes, require_accuracy
from cosim.results.result import BaliseRecord
from cosim.results.results_folder import EVENTS
from fmus.fmi.standard import TIME_TOLERANCE
from plant_models.hybrid.units import UnitError, conversion, parse_unit

_NEEDED = ("stamp", "position")
_DEFAULTS = {f.name: f.default for f in fields(BaliseRecord) if f.default is not MISSING} | {"true_position": nan}
_KINDS = ("true", "missed", "false")


def _holds_telegrams(path: Path) -> bool:
    """Whether a file is a CSV with a column ``stamp``."""
    if path.suffix.lower() != ".csv" or not path.is_file():
        return False
    return "stamp" in [split_unit(heading)[0] for heading in csv_dialect(path).headings]


def _read_telegrams(path: Path) -> list[BaliseRecord]:
    """Read a table of telegrams, one a line.

    What is not given: ``delivered_at`` is the stamp, ``identity`` is ``T1``, ``T2``, ... in the order of the file,
    ``kind`` is ``true``, the location accuracy is zero, the odometer reading and the true position are unknown. Units
    in brackets behind the names are converted; without one it is the SI unit.
    """
    dialect = csv_dialect(path)
    factors = _columns(path, dialect.headings)
    events: list[BaliseRecord] = []
    for line, text in dialect.numbered_rows():
        row = dict(zip(factors, dialect.cells(text), strict=False))
        try:
            events.append(_record(row, factors, f"T{len(events) + 1}"))
        except ValueError as error:
            raise ValueError(f"{path}, line {line}: {error}") from error
    return events


def _columns(path: Path, headings: tuple[str, ...]) -> dict[str, float]:
    """Factors to the SI unit, by name of the column."""
    factors: dict[str, float] = {}
    for heading in headings:
        name, unit = split_unit(heading)
        if name not in TELEGRAM_ROWS.columns:
            raise OutputError(f"{path}: unknown column {heading!r}; {nearest(name, TELEGRAM_ROWS.columns)}")
        try:
            factors[name] = (
                1.0 if unit is None else conversion(parse_unit(unit), parse_unit(TELEGRAM_UNITS.get(name, "1")))[0]
            )
        except UnitError as error:
            raise OutputError(f"{path}: column {heading!r}: {error}.") from error
    lacking = [name for name in _NEEDED if name not in factors]
    if lacking:
        raise OutputError(f"{path}: telegrams need the columns 'stamp' and 'position'; missing: {', '.join(lacking)}.")
    return factors


def _record(row: dict[str, str], factors: dict[str, float], identity: str) -> BaliseRecord:
    values: dict[str, Any] = {**_DEFAULTS, "identity": identity, "outcomes": {}}
    for name, text in row.items():
        if text == "":
            continue
        if name in TELEGRAM_ROWS.numbers:
            try:
                values[name] = float(text) * factors[name]
            except ValueError:
                raise ValueError(f"{name}: expected a number, got {text!r}.") from None
        else:
            values[name] = parse_outcomes(text) if name == "outcomes" else text
    for name in _NEEDED:
        if name not in values:
            raise ValueError(f"{name} is empty.")
    require_accuracy(values["location_accuracy"])
    if values["kind"] not in _KINDS:
        raise ValueError(f"kind {values['kind']!r}: expected one of {', '.join(_KINDS)}.")
    values.setdefault("delivered_at", nan if values["kind"] == "missed" else values["stamp"])
    return BaliseRecord(**values)


@dataclass(frozen=True)
class RecordedLayout:
    """The telegrams of an earlier run.

    Args:
        records: in order of their stamps.
        source: where they come from, for people.
        before: how many more were delivered before the run.
    """

    records: tuple[BaliseRecord, ...]
    source: str = ""
    before: int = 0
    instants: np.ndarray = field(init=False, repr=False, compare=False)
    """Stamps of the balises that were delivered [s], increasing."""

    def __post_init__(self) -> None:
        for number, record in enumerate(self.records, start=1):
            if not np.isfinite(record.stamp) or not np.isfinite(record.position):
                what = "stamp" if not np.isfinite(record.stamp) else "position"
                raise ScenarioError(
                    f"{self.source}: telegram {number} ({record.identity}): its {what} is not a finite number."
                )
            try:
                require_accuracy(record.location_accuracy)
            except ValueError as error:
                raise ScenarioError(f"{self.source}: telegram {number} ({record.identity}): {error}") from error
            if record.delivered_at < record.stamp:
                raise ScenarioError(
                    f"{self.source}: telegram {number} ({record.identity}) was delivered at {record.delivered_at:g} s, "
                    f"before "
                    f"its stamp, {record.stamp:g} s."
                )
        object.__setattr__(self, "instants", np.unique([r.stamp for r in self.records if r.kind == "true"]))

    def later(self, start: float) -> RecordedLayout:
        """The same without what was delivered before `start` [s]."""
        first = start - TIME_TOLERANCE
        kept = [r for r in self.records if (r.stamp if r.kind == "missed" else r.delivered_at) >= first]
        lost = sum(r.kind != "missed" for r in self.records) - sum(r.kind != "missed" for r in kept)
        return RecordedLayout(tuple(kept), self.source, self.before + lost)

    def never_delivered(self, start: float, stop: float) -> list[str]:
        """A warning of telegrams that a run from `start` to `stop` [s] does not reach; empty where it reaches all."""
        after = sum(r.kind != "missed" and r.stamp > stop + TIME_TOLERANCE for r in self.records)
        named = [f"{self.before} before it starts at {start:g} s"] if self.before else []
        named += [f"{after} after it stops at {stop:g} s"] if after else []
        return [f"{self.source}: telegrams outside the run are not delivered: {' and '.join(named)}."] if named else []


class RecordedLocaliser(Localiser):
    """Steps the watched plant and gives the recorded crossings. False telegrams are crossings of nothing.

    Args:
        watch: the plant. layout: what was received.

    `records` are the telegrams in order of their stamps, `next` is the number of the first one that lies ahead.
    """

    method: Method = "recorded"

    def __init__(self, watch: PlantMonitor, layout: RecordedLayout) -> None:
        super().__init__(watch, InstantLayout(layout.instants))
        self.records, self.next = layout.records, 0

    def step(self, t: float, until: float) -> list[tuple[Crossing, np.ndarray]]:  # noqa: D102 - see Localiser
        first = self.next
        while self.next < len(self.records) and self._is_due(self.records[self.next], until):
            self.next += 1
        due = self.records[first : self.next]
        start, found = self.watch.outputs.copy(), []
        there = {record.stamp: self._played_back(t, record.stamp, until) for record in due}
        self.watch.step(t, until)
        for record in due:
            outputs = there[record.stamp]
            found.append(
                (
                    recorded_crossing(record),
                    self._between(start, t, record.stamp, until) if outputs is None else outputs,
                )
            )
        return found

    def save(self) -> Any:  # noqa: D102 - see Localiser
        return self.next

    def restore(self, state: Any) -> None:  # noqa: D102 - see Localiser
        self.next = state

    @staticmethod
    def _is_due(record: BaliseRecord, until: float) -> bool:
        """As in the run that was recorded: a crossing belongs to the step that it lies in, a false telegram comes in
        time.
        """
        return record.stamp <= until + (TIME_TOLERANCE if record.kind == "false" else 0.0)

    def _played_back(self, t: float, stamp: float, until: float) -> np.ndarray | None:
        """The plant's outputs at a stamp within the step; None where the plant is no recording, so only it knows
        them.
        """
        component = self.watch.component
        if not isinstance(component, RecordingComponent) or not t + TIME_TOLERANCE < stamp < until - TIME_TOLERANCE:
            return None
        state, outputs = self.watch.save(), self.watch.outputs.copy()
        self.watch.step(t, stamp)
        there = self.watch.outputs.copy()
        self.watch.restore(state)
        self.watch.release(state)
        self.watch.outputs[:] = outputs
        return there

    def _between(self, start: np.ndarray, t: float, stamp: float, until: float) -> np.ndarray:
        """The same from the ends of a step that was taken; `start` are the outputs at `t`, shape (q,)."""
        share, own = min(max((stamp - t) / (until - t), 0.0), 1.0), self.watch.position_column
        position = start[own] + share * (self.watch.outputs[own] - start[own])
        return self.watch.between(start, share, self.watch.metres(float(position)))


def recorded_crossing(record: BaliseRecord) -> Crossing:
    """The crossing of a recorded telegram.

    Args:
        record: the telegram.
    """
    return Crossing(record.stamp, record.position, record.identity, record.location_accuracy, record.method)


@dataclass(frozen=True)
class RecordedChannel(Channel):
    """Delivers what was delivered: number for number the recorded telegrams, whatever was passed.

    Args:
        records: in order of their stamps.
    """

    records: tuple[BaliseRecord, ...] = ()

    def transmit(
        self, crossing: Crossing, number: int, odometer_reading: float, outcomes: Mapping[str, str] = NO_OUTCOMES
    ) -> BaliseRecord:
        """The recorded telegram of this number."""
        return replace(self.records[number], outcomes=outcomes)


def read_layout(path: Path) -> RecordedLayout:
    """The telegrams of a results folder, of its ``events.csv``, or of another file that keeps telegrams, alone or
    beside rows.

    Args:
        path: of the file.

    Raises:
        ScenarioError: there is no such file, or it is not one that holds telegrams; the line is named.
    """
    try:
        events = _read(path)
    except (OSError, ValueError) as error:
        words = str(error)
        raise ScenarioError(words if words.startswith(str(path)) else f"{path} holds no telegrams: {words}") from error
    order = sorted(events, key=lambda record: record.stamp)  # stable: of one stamp those delivered first come first
    return RecordedLayout(tuple(order), str(path))


def _read(path: Path) -> Sequence[BaliseRecord]:
    if path.is_dir() and (path / EVENTS).is_file():
        return read_once(TELEGRAM_ROWS.read, path / EVENTS)
    if path.name.endswith(EVENTS) and not path.is_file():
        raise OutputError("there is no such file.")
    if _holds_telegrams(path):
        return _read_telegrams(path)
    result = load_result(path)
    # a run keeps its telegrams, also where there were none
    if not result.events and "components" not in result.summary:
        raise OutputError(
            "it is a table of signals; expected a results folder, or a CSV with columns 'stamp' and 'position'."
        )
    return result.events
