"""A run made by hand, whose errors, indicators and telegrams are known without computing."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from cosim.evaluation.spec import ReportSpec
from cosim.expectations import Evaluated, evaluate
from cosim.results.result import BaliseRecord, Result, SignalInfo
from cosim.run.outcome import Outcome
from cosim.scenario.schema import parse_scenario

TIME = np.array([0.0, 1, 2, 3, 4, 5, 5, 6, 7, 8, 9, 10])
"""Every second [s], with an event at 5 s."""
AFTER = np.arange(12) >= 6
"""Rows from the one after the event on."""
UNITS = {"speed": "m/s", "position": "m", "slip": "1", "adhesion_force": "N", "indicator": "1", "bound": "m/s"}


def columns() -> dict[str, np.ndarray]:
    """The train stands still at 10 m/s; the observer is 0.5 m/s too fast before the event and 0.1 m/s too slow after
    it.
    """
    return {
        "train.speed": np.full(12, 10.0),
        "train.position": 10.0 * TIME,
        "train.slip": np.zeros(12),
        "train.adhesion_force": np.full(12, 100.0),
        "observer.speed": np.where(AFTER, 9.9, 10.5),
        "observer.position": 10.0 * TIME - 0.01 * TIME,
        "observer.slip": np.full(12, 0.25),
        "observer.adhesion_force": np.where(TIME == 7.0, 60.0, 100.0),
        "other.speed": np.full(12, 10.25),
        "observer.indicator": np.where((TIME >= 6.0) & (TIME < 8.0), 1.0, 0.0),  # on from 6 s up to 8 s
        "alarm.indicator": np.where(AFTER & (TIME < 8.0), 2.0, 1.0),  # on from the event at 5 s up to 8 s
    }


def telegrams() -> list[BaliseRecord]:
    """Five: one missed at 1 s, one false and rejected at 2 s, one late at 3 s, one used at 6 s, one not yet delivered
    at 9 s.
    """

    def reported(stamp: float, name: str, first: str, second: str, **more: Any) -> BaliseRecord:
        return BaliseRecord(
            stamp, stamp, name, 10.0 * stamp, 10.0 * stamp, outcomes={"observer": first, "other": second}, **more
        )

    return [
        BaliseRecord(1.0, math.nan, "A", 10.0, 10.0, kind="missed"),
        reported(2.0, "B", "rejected", "accepted", kind="false"),
        reported(3.0, "C", "late", "accepted"),
        reported(6.0, "D", "accepted", "replayed"),
        reported(9.0, "E", "undelivered", "undelivered"),
    ]


def summary() -> dict[str, Any]:
    """One certificate that holds, one that does not, one for unknown gaps; two warnings."""
    return {
        "certificates": {
            "observer": {"holds": True, "aperiodic_limit": 3.5, "max_gap": 3.0, "largest_gap_seen": 3.25},
            "other": {"holds": False, "aperiodic_limit": 2.0, "max_gap": 3.0, "largest_gap_seen": 1.0},
            "third": {"holds": None, "aperiodic_limit": None, "max_gap": None, "largest_gap_seen": 8.0},
        },
        "warnings": ["the rails are wet", "the coffee is cold"],
    }


def hand_made(
    until: float = 10.0, failure: str | None = None, changes: Mapping[str, np.ndarray] | None = None
) -> Result:
    """The run, as far as `until` [s], with some columns changed."""
    rows = until >= TIME
    all_columns = {**columns(), **(changes or {})}
    table = np.empty(int(rows.sum()), [("time", "f8"), *((name, "f8") for name in all_columns)])
    table["time"] = TIME[rows]
    for name, values in all_columns.items():
        table[name] = values[rows]
    signals = [SignalInfo(name, UNITS.get(name.partition(".")[2], "1")) for name in all_columns]
    return Result(table, signals, [e for e in telegrams() if e.stamp <= until], summary(), failure)


SPEC = ReportSpec(
    true_speed="train.speed",
    true_position="train.position",
    true_slip="train.slip",
    true_adhesion_force="train.adhesion_force",
    observers=("observer",),
)


def evaluated(result: Result, *items: Mapping[str, Any], spec: ReportSpec = SPEC) -> list[Evaluated]:
    """What becomes of expectations of a run that was to go from 0 to 10 s."""
    table = parse_scenario(
        {"stop": 10.0, "step": 1.0, "components": {"train": {"model": "locomotive"}}, "expect": list(items)}, "test"
    )
    return evaluate(table, Outcome(result, spec))
