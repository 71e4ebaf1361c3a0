"""Speeds that are in another unit than they are taken in, seen from a run: the position that does not follow, the
odometer that reads a multiple. Imports NumPy only.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cosim.evaluation.roles import recorded
from cosim.evaluation.spec import ReportSpec
from cosim.results.result import Result
from fmus.tables.numbers import number

_LEAST, _MOST = 0.5, 2.0
"""Wheels that slip or are worn, and coarse rows, stay within these factors over a journey; units do not."""
_SHORTEST = 10.0  # [m]: a shorter way says nothing
_MOVES = 1.0  # [m/s]: below this speed a reading says nothing
_USUAL = {3.6: "km/h", 1e3: "mm/s", 100.0: "cm/s", 2.23694: "mph"}


def speed_warnings(result: Result, spec: ReportSpec) -> Iterator[str]:
    """Where true position, true speed and odometer do not go together, in words.

    Args:
        result: the run. spec: names of true position, true speed and odometer.
    """
    speed = recorded(result, spec.true_speed)
    if speed is None or len(result.time) < 2 or not np.all(np.isfinite(speed)):
        return
    position, odometer = recorded(result, spec.true_position), recorded(result, spec.odometer)
    if position is not None and np.all(np.isfinite(position)):
        way = float(np.sum(np.abs(np.diff(position))))
        expected = float(np.sum(0.5 * np.abs(speed[1:] + speed[:-1]) * np.diff(result.time)))
        if max(way, expected) > _SHORTEST and not _LEAST * way <= expected <= _MOST * way:
            yield (
                f"{spec.true_speed} and {spec.true_position} do not go together: the train moves {number(way)} m, "
                f"and its speed makes {number(expected)} m of it{_ratio(expected, way)}. Where one of them declares no "
                "unit, convert it (a factor in the connection, or the unit in the FMU), or name other signals."
            )
            return
    moving = np.abs(speed) > _MOVES
    if odometer is not None and moving.any():
        factor = float(np.median(odometer[moving] / speed[moving]))
        if np.isfinite(factor) and factor != 0.0 and not _LEAST <= factor <= _MOST:
            yield (
                f"{spec.odometer} reads {number(factor)} times {spec.true_speed} for half of the way or more"
                f"{_ratio(factor, 1.0)}; it is taken in m/s. Where it declares no unit, convert it: "
                'connections = [{ from = "...", to = "...", factor = ... }].'
            )


def _ratio(value: float, other: float) -> str:
    """The usual unit that a ratio speaks for, in brackets, or nothing."""
    ratio = value / other if other else 0.0
    return next((f" ({unit} taken for m/s?)" for f, unit in _USUAL.items() if abs(ratio / f - 1.0) < 0.05), "")
