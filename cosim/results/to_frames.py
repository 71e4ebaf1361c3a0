"""Results as pandas and xarray know them. Touches no file; the packages come with the extra ``frames``.

Rows before and after an event keep their common time: the index of a frame is then not unique, as in the result.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from cosim.results.optional import optional_module
from cosim.results.record_rows import TELEGRAM_ROWS, TELEGRAM_UNITS
from cosim.results.result_data import ResultData, SignalInfo


def _chosen(result: ResultData, signals: Iterable[str] | None) -> list[SignalInfo]:
    """What the wanted columns are; all where none are named."""
    known = {signal.name: signal for signal in result.signals}
    names = (result.table.dtype.names or ())[1:] if signals is None else tuple(signals)
    return [known.get(name, SignalInfo(name)) for name in names]


def to_pandas(result: ResultData, signals: Iterable[str] | None = None) -> Any:
    """A data frame with the index ``time`` [s] and a column each for the signals, in SI units.

    Args:
        result: the result. signals: names of those wanted, in the order wanted; all by default.

    Returns:
        `pandas.DataFrame`; ``attrs`` holds ``units`` (of the numbers), ``declared_units``, ``display_units`` and
        ``descriptions`` by column, and ``failure``.

    Raises:
        KeyError: a signal was not recorded. OutputError: pandas is not installed.
    """
    pandas = optional_module("pandas", "Data frames")
    chosen = _chosen(result, signals)
    names = [signal.name for signal in chosen]
    values = np.empty((len(result.table), len(names)))
    for place, name in enumerate(names):
        values[:, place] = result[name]
    frame = pandas.DataFrame(values, index=pandas.Index(np.array(result.time), name="time"), columns=names, copy=False)
    frame.attrs["units"] = {s.name: s.unit for s in chosen}
    frame.attrs["declared_units"] = {s.name: s.declared_unit for s in chosen if s.declared_unit is not None}
    frame.attrs["display_units"] = {s.name: s.display_unit for s in chosen if s.display_unit is not None}
    frame.attrs["descriptions"] = {s.name: s.description for s in chosen}
    frame.attrs["failure"] = result.failure
    return frame


def _event_columns(result: ResultData) -> dict[str, Any]:
    """Columns of the telegrams; ``outcome.NAME`` is what became of each at a receiver, empty where it did not come."""
    columns: dict[str, Any] = {}
    for name in TELEGRAM_ROWS.columns:
        if name != "outcomes":
            values = [getattr(event, name) for event in result.events]
            columns[name] = np.array(values, np.float64) if name in TELEGRAM_ROWS.numbers else np.array(values, object)
    receivers = dict.fromkeys(receiver for event in result.events for receiver in event.outcomes)
    for receiver in receivers:
        columns[f"outcome.{receiver}"] = np.array([event.outcomes.get(receiver, "") for event in result.events], object)
    return columns


def events_to_pandas(result: ResultData) -> Any:
    """The telegrams as a data frame, one row each, in order of delivery.

    Args:
        result: the result.

    Returns:
        `pandas.DataFrame` with the columns of `cosim.results.result.BaliseRecord`, but a column ``outcome.NAME`` for
        each receiver; ``attrs["units"]`` holds units by column.

    Raises:
        OutputError: pandas is not installed.
    """
    frame = optional_module("pandas", "Data frames").DataFrame(_event_columns(result))
    frame.attrs["units"] = dict(TELEGRAM_UNITS)
    return frame


def to_xarray(result: ResultData, signals: Iterable[str] | None = None) -> Any:
    """A data set over ``time`` [s], telegrams over ``event``.

    Args:
        result: the result. signals: names of those wanted; all by default.

    Returns:
        `xarray.Dataset`: a variable each for the signals, with the attributes ``units`` (as the CF conventions call
        it), ``long_name``, ``variability`` and, where there are such, ``declared_unit`` and ``display_unit``; the
        columns of the telegrams as ``balise_stamp``, ``balise_position``, ...; ``failure`` as an attribute of the set.

    Raises:
        KeyError: a signal was not recorded. OutputError: xarray is not installed.
    """
    xarray = optional_module("xarray", "Data sets")
    variables: dict[str, Any] = {
        s.name: ("time", np.array(result[s.name]), _attributes(s)) for s in _chosen(result, signals)
    }
    for name, values in _event_columns(result).items():
        unit = {"units": TELEGRAM_UNITS[name]} if name in TELEGRAM_UNITS else {}
        variables[f"balise_{name}"] = ("event", values, unit)
    time = ("time", np.array(result.time), {"units": "s", "long_name": "time"})
    attributes = {} if result.failure is None else {"failure": result.failure}
    return xarray.Dataset(variables, coords={"time": time}, attrs=attributes)


def _attributes(signal: SignalInfo) -> dict[str, str]:
    known = {"units": signal.unit, "variability": signal.variability}
    known |= {"long_name": signal.description} if signal.description else {}
    more = {"declared_unit": signal.declared_unit, "display_unit": signal.display_unit}
    return known | {name: unit for name, unit in more.items() if unit is not None}
