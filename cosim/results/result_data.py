"""The data of a result: one table, one list of events, one summary. Imports NumPy only."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from cosim.diagnostics.messages import Message
from cosim.errors import nearest
from cosim.results.shown_unit import ShownUnit
from fmus.tables.table import SCREEN_ROWS, Column, FirstScreen, Parts, Table, name_column, text_column


@dataclass(frozen=True, slots=True)
class SignalInfo:
    """What a column of the table is.

    Args:
        name: ``component.signal``.
        unit: SI unit, ``1`` for a pure number.
        display_unit: unit in which its FMU wants it shown to people; None where it wants none.
        variability: ``continuous`` or ``discrete`` (held between its changes).
        description: one line.
        can_be_missing: whether NaN says that there is no value.
        declared_unit: unit in which its FMU counts, in which files hold it; None for `unit`.
        display_scale: factor and offset of the display unit, ``value = factor * shown + offset``, where only the FMU
            says what its name means; None where everybody understands it.
    """

    name: str
    unit: str = "1"
    display_unit: str | None = None
    variability: Literal["continuous", "discrete"] = "continuous"
    description: str = ""
    can_be_missing: bool = False
    declared_unit: str | None = None
    display_scale: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        """JSON knows lists alone."""
        if self.display_scale is not None:
            object.__setattr__(self, "display_scale", tuple(self.display_scale))

    @property
    def shown(self) -> ShownUnit:
        """The unit in which pages, tables and pictures show it: the display unit, else the declared one, else SI."""
        return ShownUnit.first_of(self.unit, (self.display_unit, self.declared_unit), self.display_scale)


@dataclass(frozen=True, slots=True)
class BaliseRecord:
    """One balise telegram of a run.

    Args:
        stamp: when the train passed the balise [s].
        delivered_at: when the receivers were notified [s]; NaN for a missed one.
        identity: name of the balise.
        position: position reported [m].
        true_position: position of the plant at the stamp [m].
        location_accuracy: Q_LOCACC reported [m].
        odometer_reading: odometer output at the crossing [m/s], NaN without an odometer.
        kind: ``true``, ``missed`` (read by nobody) or ``false`` (delivered, but no balise is there).
        method: localisation method that gave the stamp.
        time_bound: bound or estimate of the stamp's error [s], NaN where it is not known.
        outcomes: what became of it at each receiver: ``accepted``, ``replayed``, ``late``, ``rejected``,
            ``doubted`` or ``ignored`` by a gate, ``notified`` (it reports none), ``repeated`` (came before, with
            the same identity and stamp, so not delivered again), or ``undelivered`` (on its way when the run ended).
    """

    stamp: float
    delivered_at: float
    identity: str
    position: float
    true_position: float
    location_accuracy: float = 0.0
    odometer_reading: float = float("nan")
    kind: Literal["true", "missed", "false"] = "true"
    method: str = ""
    time_bound: float = 0.0
    outcomes: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class PacketRecord:
    """One packet of a run on its way through the network, see `cosim.network`.

    Args:
        stamp: when its values were measured and it was sent [s].
        delivered_at: when it arrived [s]; NaN for a lost one.
        node: who sent it.
        number: of the transmission, from 0; a duplicate has that of its packet.
        values: measurements by ``component.signal``, in the units of their components.
        kind: ``sent``, ``lost`` (it never arrives) or ``duplicate`` (the same once more).
        outcomes: what became of it at each receiver: ``held`` (its inputs follow), ``dropped`` (a duplicate, or older
            than what is held), as for telegrams where it gets them by an event, or ``undelivered`` (on its way when
            the run ended).
    """

    stamp: float
    delivered_at: float
    node: str
    number: int
    values: Mapping[str, float]
    kind: Literal["sent", "lost", "duplicate"] = "sent"
    outcomes: Mapping[str, str] = field(default_factory=dict)


_COLUMNS = (
    name_column("signal", "signal"),
    text_column("unit", "unit"),
    Column("first", "first", meaning="Value at the first row"),
    Column("last", "last", meaning="Value at the last row"),
    Column("smallest", "smallest"),
    Column("largest", "largest"),
)


@dataclass(frozen=True)
class ResultData(FirstScreen, Mapping[str, np.ndarray]):
    """Everything a run leaves behind, as the readers of files return it; a mapping from the names of the columns,
    ``time`` first, to their values.

    Args:
        table: structured array, first field ``time`` [s], then one float64 field ``component.signal`` for each recorded
            signal. A row labelled t holds the values at t; an event gives two rows with the same time, before and
            after.
        signals: what each column is, in column order, without ``time``.
        events: the balise telegrams in order of delivery.
        summary: versions, parameters, certificates, methods, wall times, warnings; JSON-able.
        failure: why the run ended early, or None.
        messages: what the components logged, in order of time.
        packets: those of the network, in order of sending.
    """

    table: np.ndarray
    signals: Sequence[SignalInfo]
    events: Sequence[BaliseRecord] = ()
    summary: Mapping[str, Any] = field(default_factory=dict)
    failure: str | None = None
    messages: Sequence[Message] = ()
    packets: Sequence[PacketRecord] = ()

    @property
    def time(self) -> np.ndarray:
        """Time of the rows [s], shape (rows,)."""
        return np.asarray(self.table["time"])

    def __getitem__(self, name: str) -> np.ndarray:
        """Values of one signal in its SI unit, shape (rows,).

        Raises:
            KeyError: the signal was not recorded; the message lists the nearest names. The key is no name: the message
                says how rows are chosen.
        """
        names = self.table.dtype.names or ()
        key: Any = name
        if not isinstance(key, str):
            example = names[1] if len(names) > 1 else "time"
            raise KeyError(f"{key!r} is no name of a signal; a name is wanted, and rows behind it: [{example!r}][0]")
        if name not in (self.table.dtype.fields or {}):
            raise KeyError(f"signal {name!r} was not recorded; {nearest(name, names)}")
        return np.asarray(self.table[name])

    def __iter__(self) -> Iterator[str]:
        return iter(self.table.dtype.names or ())

    def __len__(self) -> int:
        return len(self.table.dtype.names or ())

    def first_screen(self) -> Parts:
        """How long the result is, and its signals."""
        rows = len(self.table)
        span = f" from {self.time[0]:g} to {self.time[-1]:g} s" if rows else ""
        telegrams = f", {len(self.events)} telegrams" if self.events else ""
        sentence = f"{rows} rows{span}, {len(self) - 1} signals{telegrams}."
        return [sentence if self.failure is None else f"{sentence} Ended early: {self.failure}", self.signals_table()]

    def signals_table(self) -> Table:
        """The first signals, with their ends and extremes in the units in which they are shown."""
        names, rows = list(self)[1:], []
        units = {signal.name: signal.shown for signal in self.signals}
        for name in names[:SCREEN_ROWS]:
            unit = units.get(name, ShownUnit())
            values = unit.values(np.asarray(self[name], dtype=float))
            known = values[~np.isnan(values)]
            ends = [float(values[0]), float(values[-1])] if len(values) else [None, None]
            extremes = [float(known.min()), float(known.max())] if len(known) else [None, None]
            rows.append([name, unit.name, *ends, *extremes])
        more = len(names) - len(rows)
        return Table("signals", _COLUMNS, rows, notes=[f"... and {more} more signals"] if more else [])

    def info(self, name: str) -> SignalInfo:
        """What a column is.

        Args:
            name: name of the column.
        """
        return next(s for s in self.signals if s.name == name)
