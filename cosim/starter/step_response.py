"""What the response to a step of the effort shows: which outputs are position, speed and wheel speed, in which units
and directions, and what the input is. Pure functions of columns; knows no FMU.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import log2, pi

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LENGTHS: Mapping[str, float] = {"m": 1.0, "km": 1e3}
SPEEDS: Mapping[str, float] = {"m/s": 1.0, "km/h": 1.0 / 3.6, "mph": 0.44704}
FORCES: Mapping[str, float] = {"N": 1.0, "kN": 1e3, "MN": 1e6}
ALIKE = 0.02
"""How much a factor may differ from that of a unit, by its share."""
_LIGHTEST, _HEAVIEST = 8e3, 8e6  # [kg] less than a thousand times, so that one unit fits
_ROTATING = 0.6, 1.15
"""Mass of a train by its acceleration, as a share of its weight's mass: rotating masses, and what else slows it."""
_RADII = 0.25, 0.65  # [m]


@dataclass(frozen=True)
class StepResponse:
    """Differences between two runs, one with more of an input than the other.

    Args:
        time: of the rows [s], shape (n,), equidistant. step: how much more of the input, in its own unit.
        columns: by name of the output, shape (n,); in SI where it declares a unit, else as it is.
    """

    time: Array
    step: float
    columns: Mapping[str, Array]

    def slope(self, name: str) -> float:
        """Rate of an output at the end [1/s], by the unit of the input."""
        column, from_there = self.columns[name], 3 * len(self.time) // 4
        return float((column[-1] - column[from_there]) / (self.time[-1] - self.time[from_there]) / self.step)

    def order(self, name: str) -> float:
        """With which power of the time an output grows: 0 of a force, 1 of a speed, 2 of a position; -1 where it does
        not.
        """
        column = self.columns[name]
        middle, end = abs(float(column[len(column) // 2])), abs(float(column[-1]))
        return log2(end / middle) if middle > 0.0 and np.isfinite(end) and end > 0.0 else -1.0

    def speeds(self) -> list[str]:
        """Outputs that grow as a speed does."""
        return [name for name in self.columns if 0.5 < self.order(name) < 1.5]

    def integral_factor(self, name: str, rate: str) -> float | None:
        """``k`` of ``d(name)/dt = k * rate``; None where it is not so."""
        column, values = self.columns[name], self.columns[rate]
        integral = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(self.time) * (values[1:] + values[:-1]))])
        size, reach = float(integral @ integral), float(np.abs(column).max())
        if size == 0.0 or reach == 0.0 or not np.isfinite(column).all():
            return None
        factor = float(integral @ column) / size
        return factor if float(np.abs(column - factor * integral).max()) < ALIKE * reach else None


@dataclass(frozen=True)
class FoundMotion:
    """Speed and position of the train.

    Args:
        speed: name of it. speed_unit: of it. position, position_unit: likewise; None where there is none.
        agree: 1 where both count in the same direction, -1 where they do not.
    """

    speed: str
    speed_unit: str
    position: str | None = None
    position_unit: str | None = None
    agree: int = 1


def find_motion(response: StepResponse, declared: Sequence[str], named: Sequence[str]) -> FoundMotion | None:
    """The pair of position and speed whose rates fit in units that trains have.

    Args:
        response: to a step of the effort. declared: outputs that are in SI. named: outputs whose names speak for them;
            these come first.

    Returns:
        The pair, or None where there is none.
    """
    pairs = [
        FoundMotion(speed, its, position, other, sign)
        for speed in response.speeds()
        for position in response.columns
        if (k := response.integral_factor(position, speed)) is not None and response.order(position) > 1.3
        for its, other, sign in _units_of_pair(k, speed in declared, position in declared)
    ]
    return max(pairs, key=lambda pair: (pair.speed in named) + (pair.position in named), default=None)


def _units_of_pair(k: float, speed_known: bool, position_known: bool) -> Iterator[tuple[str, str, int]]:
    """Units of speed and position that explain a factor between them, and 1 or -1 for the directions."""
    for speed, factor in list(SPEEDS.items())[: 1 if speed_known else None]:
        for position, length in list(LENGTHS.items())[: 1 if position_known else None]:
            if abs(abs(k) * length / factor - 1.0) < ALIKE:
                yield speed, position, 1 if k > 0.0 else -1


def wheel_unit(ratio: float) -> tuple[str, float | None] | None:
    """Unit of a wheel speed, and the radius [m] where it turns.

    Args:
        ratio: of it to the speed of the train [m/s], in a run in which the wheel hardly slips.
    """
    for unit, factor in SPEEDS.items():
        if -ALIKE < ratio * factor - 1.0 < 5.0 * ALIKE:
            return unit, None
    for unit, factor in (("rad/s", 1.0), ("rpm", pi / 30.0)):
        radius = 1.0 / (ratio * factor)
        if _RADII[0] < radius < _RADII[1]:
            return unit, round(radius, 3)
    return None


def force_unit(acceleration: float, mass: float | None) -> str | None:
    """Unit of an effort; None where it is none of `FORCES`.

    Args:
        acceleration: of the train by one of it [m/s2]. mass: of the train [kg]; None where nobody knows it.
    """
    for unit, factor in FORCES.items():
        inertia = factor / acceleration
        if mass is None and _LIGHTEST < inertia < _HEAVIEST:
            return unit
        if mass is not None and _ROTATING[0] < mass / inertia < _ROTATING[1]:
            return unit
    return None


def speed_unit_by_effort(rate: float, force: float, mass: float) -> str | None:
    """Unit of a speed without a position, by ``mass * d(speed)/dt = effort``; None where it is neither m/s nor km/h.

    Args:
        rate: of the speed by one of the effort, in its own unit by second. force: of one of the effort [N].
        mass: of the train [kg].
    """
    for unit in ("m/s", "km/h"):
        if _ROTATING[0] < mass * rate * SPEEDS[unit] / force < _ROTATING[1]:
            return unit
    return None
