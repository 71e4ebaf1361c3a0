"""The wheel between train and odometer: it rolls, jams or skids. Why and when is the matter of its cause."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from plant_models.faults.fault_cause import ADHESION_LIMIT, BRAKE_RELEASED, EFFORT, RELEASE_TIME, Carrier
from plant_models.faults.fault_system import CAUSES, FaultSystem, active, unfinished_output
from plant_models.hybrid import Array, input_signal, output_signal, parameter, state
from plant_models.hybrid.option import require_chosen

DistanceFrom = Literal["speed", "position"]


class WheelFault(FaultSystem):
    """Wheel speed ``v (1 + d)`` of a wheel that jams (depth ``d`` from -1 to 0) or skids (``d`` above 0).

    `speed` is that of the wheel without the fault, `wheel_speed` of the train. `wheel_distance` is the integral of
    `wheel_speed`: the edges of a fault are hit exactly wherever they lie in a communication step, so that a micro-jam,
    shorter than any sampling, is in the distance, although no sample of `wheel_speed` may show it. Between
    communication points `speed` is held, or goes as the master lets inputs go: what the train gains in speed within a
    step, half of it times the step, is missing in its integral. With ``distance_from="position"`` that concerns the
    faults alone: the distance is `position`, of the train, and what the faults add to it.

    A jam ends when `brake_released` was 1 for `release_time` in it; in ``drawn`` as well when its effort was taken back
    for so long; in ``adhesion`` the wheel takes up rolling in `release_time`. The 0.146 s are nominal: they follow from
    jams of 0.2 s that are cut to 0.15 s by a release 4 ms after their onset.

    `effort_loss` is the share of the effort that does not reach the rail, `jam_loss` times the depth of a jam,
    `skid_loss` times that of a skid; it belongs to the input of the same name of `longitudinal_train`.

    Args:
        cause: ``stated``, ``drawn`` from the seed, by ``adhesion``, or another one, see `CAUSES`.
        fault_count: number of faults of ``stated``.
        distance_from: ``speed``, or ``position``, which adds that input.

    Raises:
        ValueError: an unknown cause or source of the distance, or a count below one.

    Source: Aguiar Cota 2019, (2.29), Figs. 2-13 and 2-14, section 3.2.2.4; the causes, the time laws and the
    distributions are ours.
    """

    name = "wheel_fault"
    description = "Wheel that jams and skids, given, drawn or by adhesion: speed in, wheel speed and distance out"
    source = "Aguiar Cota 2019, (2.26)-(2.29), Figs. 2-13 and 2-14; causes and time laws are ours"
    states = (state("rim_distance", "m", 0.0, "Distance run by the wheel's rim at start"),)
    parameters = (
        RELEASE_TIME,
        parameter("jam_loss", "1", 0.0, "Share of the effort that is lost in a full jam", min=0.0, max=1.0),
        parameter("skid_loss", "1", 0.0, "Share of the effort that is lost in a skid of depth 1", min=0.0, max=1.0),
    )
    outputs = (
        output_signal("wheel_speed", "m/s", "Circumferential speed of the wheel", display_unit="km/h"),
        output_signal("wheel_distance", "m", "Distance run by the wheel's rim"),
        output_signal("active", "1", "1 while the wheel jams or skids"),
        output_signal("depth", "1", "Share of the speed that is missing (jam < 0) or too much (skid > 0)"),
        output_signal("effort_loss", "1", "Share of the effort that does not reach the rail"),
        unfinished_output("given fault"),
    )
    option_choices = {
        "cause": CAUSES,
        "fault_count": range(1, 65),
        "distance_from": ("speed", "position"),
    }

    def __init__(self, *, cause: str = "stated", fault_count: int = 4, distance_from: DistanceFrom = "speed") -> None:
        require_chosen(self.name, self.option_choices, distance_from=distance_from)
        self.distance_from = distance_from
        self.inputs = (*_INPUTS, *((_POSITION,) if distance_from == "position" else ()))
        options = {"cause": cause, "fault_count": fault_count, "distance_from": distance_from}
        super().__init__(Carrier("m/s", fault_count=fault_count), **options)

    def healthy(self, u: Any) -> Sequence[Array]:
        """The speed of the wheel without the fault."""
        return (u.speed,)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        (speed,), fault = self.faulty(t, x, u, p)
        turning = 1.0 if self.distance_from == "speed" else 0.0  # else only what the fault adds is integrated here
        rate = speed * (turning + fault.depth) + fault.added[0] + (1.0 - turning) * (speed - u.speed)
        return {"rim_distance": rate, **super().flow(t, x, u, p)}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        (speed,), fault = self.faulty(t, x, u, p)
        jammed, skidding = np.maximum(-fault.depth, 0.0), np.maximum(fault.depth, 0.0)
        return {
            "wheel_speed": speed * (1.0 + fault.depth) + fault.added[0],
            "wheel_distance": x.rim_distance if self.distance_from == "speed" else u.position + x.rim_distance,
            "active": active(fault),
            "depth": fault.depth + 0.0 * x.rim_distance,
            "effort_loss": np.minimum(p.jam_loss * jammed + p.skid_loss * skidding, 1.0),
            "faults_unfinished": fault.unfinished,
        }


_INPUTS = (
    input_signal("speed", "m/s", 0.0, "Circumferential speed of the wheel without the fault", display_unit="km/h"),
    EFFORT,
    ADHESION_LIMIT,
    BRAKE_RELEASED,
)
_POSITION = input_signal("position", "m", 0.0, "Position of the train")
