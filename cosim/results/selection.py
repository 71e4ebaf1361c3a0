"""Some of the signals of a result. Touches no file."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from fnmatch import fnmatchcase

from cosim.errors import OutputError, nearest
from cosim.results.result import Result
from cosim.results.result_data import SignalInfo
from cosim.results.table_layout import column_names, table_of


def selected(result: Result, patterns: Iterable[str]) -> Result:
    """The result with those signals only that are named or match a pattern such as ``train.*``; their order stays.

    Args:
        result: the run.
        patterns: names or patterns.

    Raises:
        OutputError: a pattern matches nothing; the message lists the nearest names.
    """
    names = column_names(result.table)[1:]
    wanted: set[str] = set()
    for pattern in patterns:
        found = {name for name in names if name == pattern or fnmatchcase(name, pattern)}
        if not found:
            raise OutputError(f"No signal {pattern!r} in the result; {nearest(pattern, names)}")
        wanted |= found
    kept = [name for name in names if name in wanted]
    columns = ["time", *kept]
    table = table_of(columns, [result.table[name] for name in columns])
    known = {signal.name: signal for signal in result.signals}
    return replace(result, table=table, signals=[known.get(name, SignalInfo(name)) for name in kept])
