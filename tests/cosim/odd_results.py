"""Results that are hard to keep: odd names, units in any script, odd numbers, events within a millisecond, few rows or
none.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from hypothesis import strategies as st

from cosim.results.result import BaliseRecord, Result, SignalInfo

ODD = (0.1, -0.0, 5e-324, -2.2250738585072011e-308, 1.7976931348623157e308, math.inf, -math.inf, math.nan, 1 / 3)
NAMES = (
    "a[1,2]",
    "der(train.x)",
    "été.v",
    "x/y",
    "events",
    ".",
    "..",
    "a b",
    "time_",
    "units",
    "signals",
    'q"uo;te',
    "#c",
    "a%b",
    "x [m]",
    "data_2",
    "ß",
    "速度",
    "f(x)",
    "a\\b",
    "A",
    "a",
    "summary",
    "name",
)
TEXT = st.text(st.characters(exclude_categories=["Cs", "Cc"]), max_size=12)


def odd_table(rows: int, names: tuple[str, ...] = NAMES) -> np.ndarray:
    """Rows of which two and two have the same time; each column holds another part of the odd numbers."""
    table = np.empty(rows, [("time", "f8"), *((name, "f8") for name in names)])
    table["time"] = np.arange(rows) // 2 * 0.1
    for place, name in enumerate(names):
        table[name] = [ODD[(place + row) % len(ODD)] for row in range(rows)]
    return table


def odd_events() -> list[BaliseRecord]:
    return [
        BaliseRecord(
            0.1,
            math.nan,
            'B;1, "é"',
            1 / 3,
            5e-324,
            2.0,
            math.nan,
            "missed",
            "rollback",
            math.inf,
            {"a;b": "c=d", "é": ""},
        ),
        BaliseRecord(0.2, 0.3, "", -0.0, 1e308),
    ]


def odd_result(rows: int = 9, names: tuple[str, ...] = NAMES, events: list[BaliseRecord] | None = None) -> Result:
    """A result of odd columns with what is hard to keep of each."""
    units, shown, texts = ("m/s", "1", "Ω·m", "°"), (None, "km/h", "é"), ("", "über [x]", "plain", " lead", "ends ]")
    signals = [
        SignalInfo(name, units[i % 4], shown[i % 3], "discrete" if i % 2 else "continuous", texts[i % 5])
        for i, name in enumerate(names)
    ]
    summary: dict[str, Any] = {
        "components": [{"name": "train", "parameters": {"mass": 80e3, "name": "text"}}],
        "largest": math.inf,
    }
    return Result(
        odd_table(rows, names), signals, odd_events() if events is None else events, summary, "stopped at 0.3 s"
    )


@st.composite
def results(draw: st.DrawFn) -> Result:
    """Any result: names and texts in any script, any numbers, rows in order of time."""
    names = draw(st.lists(TEXT.map(str.strip).filter(lambda n: n not in ("", "time")), unique=True, max_size=4))
    rows = draw(st.lists(st.tuples(st.floats(0, 9), *(st.floats() for _ in names)), max_size=5))
    table = np.array(sorted(rows, key=lambda row: row[0]), [("time", "f8"), *((name, "f8") for name in names)])
    for name in names:  # the payload bits of a NaN have no text in CSV
        table[name][np.isnan(table[name])] = math.nan
    kinds = st.sampled_from(["continuous", "discrete"])
    some = TEXT.filter(bool)
    signals = [SignalInfo(name, draw(some), draw(st.none() | some), draw(kinds), draw(TEXT)) for name in names]
    return Result(table, signals, odd_events()[: draw(st.integers(0, 2))])


def bits(table: np.ndarray) -> tuple[tuple[str, ...] | None, bytes]:
    return table.dtype.names, table.tobytes()


def assert_equal(result: Result, back: Result) -> None:
    """The same table bit by bit, the same signals, the same telegrams; `repr`, since NaN differs from itself."""
    assert bits(back.table) == bits(result.table)
    assert list(back.signals) == list(result.signals)
    assert repr(list(back.events)) == repr(list(result.events))
