"""Recorded telegrams: what an earlier run was told, told again, whatever the plant does now. Touches only the file it
reads.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from cosim.balises.layout import InstantLayout
from cosim.balises.localiser import Localiser, Method
from cosim.balises.plant_monitor import PlantMonitor
from cosim.balises.telegram import NO_OUTCOMES, Channel, Crossing
from cosim.components.recording import RecordingComponent
from cosim.errors import OutputError, ScenarioError
from cosim.results.formats.telegram_csv import holds_telegrams, read_telegrams
from cosim.results.load_result import load_result
from cosim.results.record_rows import TELEGRAM_ROWS, require_accuracy
from cosim.results.result import BaliseRecord
from cosim.results.results_folder import EVENTS
from fmus.fmi.standard import TIME_TOLERANCE


@dataclass(frozen=True)
class RecordedLayout:
    """The telegrams of an earlier run.

    Args:
        records: in order of their stamps.
        source: where they come from, for people.
    """

    records: tuple[BaliseRecord, ...]
    source: str = ""
    instants: np.ndarray = field(init=False, repr=False, compare=False)
    """Stamps of the balises that were told [s], increasing."""

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
        """The same without what was delivered at or before `start` [s]."""
        kept = [r for r in self.records if (r.stamp if r.kind == "missed" else r.delivered_at) > start]
        return RecordedLayout(tuple(kept), self.source)


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
        """As in the run that was recorded: a crossing belongs to the step that it lies in, a false telegram is told in
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
        return self.watch.between(start, share, float(position) * self.watch.position_scale)


def recorded_crossing(record: BaliseRecord) -> Crossing:
    """The crossing of a recorded telegram."""
    return Crossing(record.stamp, record.position, record.identity, record.location_accuracy, record.method)


@dataclass(frozen=True)
class RecordedChannel(Channel):
    """Tells what was told: number for number the recorded telegrams, whatever was passed.

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
        return TELEGRAM_ROWS.read(path / EVENTS)
    if path.name.endswith(EVENTS) and not path.is_file():
        raise OutputError("there is no such file.")
    if holds_telegrams(path):
        return read_telegrams(path)
    result = load_result(path)
    # a run keeps its telegrams, also where there were none
    if not result.events and "components" not in result.summary:
        raise OutputError(
            "it is a table of signals; expected a results folder, or a CSV with columns 'stamp' and 'position'."
        )
    return result.events
