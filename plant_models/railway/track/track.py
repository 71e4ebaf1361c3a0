"""The track under a train: zones of degraded adhesion and the gradient, as options of a plant.

Brings the parameters and reads the tables; knows the signal vocabulary and the tables, and nothing of vehicles.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from plant_models.hybrid import Array, Signal, parameter
from plant_models.hybrid.option import require_chosen, require_whole

_SMALLEST_WIDTH = 1e-9  # equal abscissae make a jump, not a division by zero


ZoneAxis = Literal["time", "position"]
GradientShape = Literal["constant", "linear"]

UNUSED_POSITION = 1e9  # [m]; a gradient point that is not laid lies beyond the end of any track
# Traction [10, 20] s and braking [70, 80] s are printed; the zone in the hold phase comes without times, [40, 50] s is
# ours.
PUBLISHED_ZONES = ((10.0, 20.0), (40.0, 50.0), (70.0, 80.0))
_CHOICES = {"zones": ("time", "position"), "gradient_shape": ("constant", "linear")}


class Track:
    """Adhesion zones by time or by position, and a gradient by position.

    A zone is the half-open interval ``[zone_from, zone_to)``; one that is not used has both ends at 0. Its edges are
    switching functions of the plant, so that they are passed exactly. The gradient is the sine of the slope
    angle, positive uphill; before its first point and after its last it stays at their values. By default only the
    first point is on the track, so setting ``gradient[1]`` alone tilts the whole of it.

    Args:
        zones: what the zones are laid along, ``time`` or ``position``.
        zone_count: number of zones.
        gradient_shape: ``constant`` between the points (each point starts a section) or ``linear``.
        gradient_count: number of gradient points.

    Attributes:
        edges: names of the edges of the zones, all starts before all ends.

    Raises:
        ValueError: an unknown option, or a count below one.

    Source: the zones of Bouchama 2024, section 3.4.3; the gradient of (4.1)-(4.5).
    """

    def __init__(
        self,
        zones: ZoneAxis = "time",
        zone_count: int = 3,
        gradient_shape: GradientShape = "constant",
        gradient_count: int = 4,
    ) -> None:
        require_chosen("Track", _CHOICES, zones=zones, gradient_shape=gradient_shape)
        require_whole("Track", zone_count=zone_count, gradient_count=gradient_count)
        self.zones = zones
        self.gradient_shape = gradient_shape
        self.parameters = _parameters(zones, zone_count, gradient_count)
        self.zone_count = zone_count
        self.edges = tuple(f"zone_{end}[{i + 1}]" for end in ("from", "to") for i in range(zone_count))

    def beyond_edges(self, t: Array, position: Array, p: Any) -> list[Array]:
        """How far beyond each of the `edges` [m], or for how long [s].

        Args:
            position: on the track [m], a scalar or shape (members,).
        """
        at = position if self.zones == "position" else t + 0.0 * position
        return [at - ends[i] for ends in (p.zone_from, p.zone_to) for i in range(self.zone_count)]

    def degraded(self, passed: Sequence[Array]) -> Array:
        """1 in a zone of degraded adhesion, else 0 [1].

        Args:
            passed: for each of the `edges` 1 where it has been passed, else 0; scalars or shape (members,).
        """
        n = self.zone_count
        inside = passed[0] * (1.0 - passed[n])
        for i in range(1, n):
            inside = np.maximum(inside, passed[i] * (1.0 - passed[n + i]))
        return inside

    def requirements(self, p: Any) -> dict[str, Array]:
        """What the ends of the zones must fulfil, see `HybridSystem.requirements`."""
        starts, ends, zones = p.zone_from, p.zone_to, range(self.zone_count)
        used = [np.where(starts[i] == 0.0, np.where(ends[i] == 0.0, 0.0, 1.0), 1.0) for i in zones]
        needed: dict[str, Array] = {}
        for i in zones:
            text = (
                f"zone {i + 1} has no length: zone_to[{i + 1}] must lie behind zone_from[{i + 1}]; if unused, both "
                f"are 0"
            )
            needed[text] = np.where(ends[i] > starts[i], 1.0, 1.0 - used[i])
        for i in zones[1:]:
            text = f"zone {i + 1} overlaps one before it in the list: move zone_from[{i + 1}] or zone_to[{i + 1}]"
            overlaps = [
                np.where(starts[i] < ends[j], np.where(starts[j] < ends[i], used[j], 0.0), 0.0) for j in zones[:i]
            ]
            needed[text] = 1.0 - used[i] * np.where(sum(overlaps) > 0.0, 1.0, 0.0)
        return needed

    def gradient(self, position: Array, p: Any) -> Array:
        """Sine of the slope angle at the position [m], positive uphill [1]."""
        read = piecewise_linear if self.gradient_shape == "linear" else _piecewise_constant
        return read(position, p.gradient_position, p.gradient)


def _parameters(zones: ZoneAxis, zone_count: int, gradient_count: int) -> tuple[Signal, ...]:
    unit = "s" if zones == "time" else "m"
    # Published zones are in time; along the track there is nothing to repeat, so no zone is active until one is laid.
    published = PUBLISHED_ZONES if zones == "time" else ()
    ends = [*published[:zone_count], *[(0.0, 0.0)] * (zone_count - len(published))]
    positions = (0.0, *[UNUSED_POSITION] * (gradient_count - 1))
    starts, stops = (tuple(column) for column in zip(*ends, strict=True))
    return (
        parameter("zone_from", unit, starts, "Start of each zone of degraded adhesion", size=zone_count),
        parameter("zone_to", unit, stops, "End of each zone of degraded adhesion", size=zone_count),
        parameter(
            "gradient_position", "m", positions, "Positions of the gradient points, ascending", size=gradient_count
        ),
        parameter(
            "gradient",
            "1",
            0.0,
            "Sine of the slope angle at each point, uphill positive",
            min=-1.0,
            max=1.0,
            size=gradient_count,
        ),
    )


def _piecewise_constant(at: Array, abscissae: Array, ordinates: Array) -> Array:
    """Staircase: the ordinate of the last point at or before `at`, and the first ordinate before the first point."""
    value = ordinates[0]
    for i in range(1, ordinates.shape[0]):
        value = np.where(at >= abscissae[i], ordinates[i], value)
    return value


def piecewise_linear(at: Array, abscissae: Array, ordinates: Array) -> Array:
    """Broken line through the points, constant before the first and after the last.

    A sum of clipped ramps: points may be repeated (padding), and two points with equal abscissae make a jump.

    Args:
        at: where to read, a scalar or shape (members,).
        abscissae: shape (n,) or (n, members), not decreasing.
        ordinates: shape (n,) or (n, members).

    Returns:
        The value there, of the shape of `at`.
    """
    value = ordinates[0]
    for i in range(ordinates.shape[0] - 1):
        width = np.maximum(abscissae[i + 1] - abscissae[i], _SMALLEST_WIDTH)
        value = value + (ordinates[i + 1] - ordinates[i]) * np.clip((at - abscissae[i]) / width, 0.0, 1.0)
    return value
