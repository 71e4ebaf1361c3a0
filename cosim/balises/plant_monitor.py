"""The watched plant: the planned component whose position and speed outputs find the balises, and how far these outputs
contradict each other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cosim.coupling.planned import PlannedComponent
from fmus.check.restoring import SOLVER_FACTOR

_STANDING = 1e-12
"""Below this speed [m/s] a plant stands."""


@dataclass(frozen=True)
class PlantError:
    """What the plant's solver contributes to the bound.

    Args:
        spread: how far its position was seen apart between results that differ by the solver's steps alone [m].
        tolerance: relative, of its solver; 0 where it has none, or where its steps were seen to make no difference.
        drift: how fast its position leaves what a finer tolerance gives [m/s]. start: of the run [s].
        unknown: why nothing can be said; empty where something can.
    """

    spread: float = 0.0
    tolerance: float = 0.0
    drift: float = 0.0
    start: float = 0.0
    unknown: str = ""

    def time(self, at: float, position: float, speed: float) -> float:
        """Bound of the error [s] of the time `at` [s] when it was at a position [m] with a speed [m/s]; NaN where not
        known.
        """
        if self.unknown:
            return math.nan
        solver = SOLVER_FACTOR * self.tolerance * max(abs(position), 1.0)
        return (self.spread + solver + self.drift * (at - self.start)) / max(abs(speed), _STANDING)

    def words(self) -> str:
        """What it holds, for people."""
        if self.unknown:
            return f"unknown: {self.unknown}"
        parts = [f"positions {self.spread:.2g} m apart under the probe"] if self.spread else []
        parts += [f"{self.drift:.2g} m a second from what a finer tolerance gives"] if self.drift else []
        parts += [f"{SOLVER_FACTOR:g} times its tolerance of {self.tolerance:g}"] if self.tolerance else []
        return f"of the search, and of the plant's solver: {', '.join(parts) or 'nothing that is known'}"


class PlantMonitor:
    """Steps the plant, `component`, and reads its position and speed. `outputs` are all its outputs, a view, shape
    (q,); `save`, `restore` and `release` are those of the plant.

    Args:
        planned: the plant in the plan.
        position: column of its position within its outputs. speed: column of its speed.
        to_metres, to_speed: factor and offset from the plant's own unit of position to [m], and of speed to [m/s].
    """

    def __init__(
        self,
        planned: PlannedComponent,
        position: int,
        speed: int,
        to_metres: tuple[float, float] = (1.0, 0.0),
        to_speed: tuple[float, float] = (1.0, 0.0),
    ) -> None:
        self._planned, self.component, self.outputs = planned, planned.component, planned.outputs
        self.save, self.restore, self.release = self.component.save, self.component.restore, self.component.release
        self._position, self._speed = position, speed
        self.to_metres, self.to_speed = to_metres, to_speed
        self.redo_differences = 0
        self.error = PlantError()
        """What the plant's own solver leaves open of its position."""

    @property
    def position_column(self) -> int:
        """Column of the position within the plant's outputs."""
        return self._position

    @property
    def speed_column(self) -> int:
        """Column of the speed within the plant's outputs."""
        return self._speed

    def metres(self, own: float) -> float:
        """A position [m] from that in the plant's own unit."""
        return own * self.to_metres[0] + self.to_metres[1]

    @property
    def position(self) -> float:
        """Position [m]."""
        return float(self.outputs[self._position]) * self.to_metres[0] + self.to_metres[1]

    @property
    def speed(self) -> float:
        """Speed [m/s]."""
        return float(self.outputs[self._speed]) * self.to_speed[0] + self.to_speed[1]

    @property
    def motion(self) -> tuple[float, float]:
        """Position [m] and speed [m/s]."""
        outputs, (factor, offset), (by, shift) = self.outputs, self.to_metres, self.to_speed
        return float(outputs[self._position]) * factor + offset, float(outputs[self._speed]) * by + shift

    def between(self, start: np.ndarray, share: float, position: float) -> np.ndarray:
        """The plant's outputs at a share of a step that began with outputs `start`, where its position was `position`
        [m].

        Continuous outputs lie on a line between the ends, discrete ones are held, the position is the given one.
        """
        end = self.outputs
        outputs = np.where(self._planned.continuous, start + share * (end - start), start)
        outputs[self._position] = (position - self.to_metres[1]) / self.to_metres[0]
        return outputs

    def step(self, t: float, until: float) -> None:
        """Send the inputs, advance to `until` [s], read outputs.

        Args:
            t: start of the step [s].
        """
        self._planned.drive(t, until)

    def send(self, t: float, until: float) -> None:
        """Send the prepared inputs for a step from `t` to `until` [s]."""
        self._planned.send(t, until)

    def read(self) -> None:
        """Read the outputs."""
        self._planned.read()
