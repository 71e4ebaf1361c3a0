"""The wheel between train and odometer: it rolls, jams or skids.

Declares the hybrid system; why and when the wheel does so is the matter of the causes in the files beside this one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal

import numpy as np

from plant_models.hybrid import HybridSystem, OutputWarning, input_signal, output_signal, parameter, state, vector
from plant_models.hybrid.noise import Purpose
from plant_models.hybrid.option import require_whole
from plant_models.hybrid.requirements import within_bounds
from plant_models.hybrid.system import Array
from plant_models.railway.faults.adhesion_faults import AdhesionFaults
from plant_models.railway.faults.drawn_faults import DrawnFaults
from plant_models.railway.faults.fault_cause import FaultCause, one_where
from plant_models.railway.faults.given_faults import GivenFaults

Cause = Literal["given", "drawn", "adhesion"]
DistanceFrom = Literal["speed", "position"]

UNLIMITED = 1e9  # [N]; the adhesion where nobody says what it is


class WheelFault(HybridSystem):
    """Wheel speed ``v (1 + d)`` of a wheel that jams (depth ``d`` from -1 to 0) or skids (``d`` above 0).

    `speed` is that of the wheel without the fault, `wheel_speed` of the train. `wheel_distance` is the integral of
    `wheel_speed`: the edges of a fault are hit exactly wherever they lie in a communication step, so that a micro-jam,
    shorter than any sampling, is in the distance, although no sample of `wheel_speed` may show it. Between
    communication points `speed` is held, or goes as the master lets inputs go: what the train gains in speed within a
    step, half of it times the step, is missing in its integral. With ``distance_from="position"`` that concerns the
    faults alone: the distance is `position`, of the train, and what the faults add to it.

    `cause`:

    - ``given``: `fault_count` faults by onset, length, depth and kind, in the order of time.
    - ``drawn``: faults of a Poisson process from the seed, jams at `jam_rate` while `effort` brakes, skids at
      `skid_rate` while it pulls; the length has an exponential, the depth a uniform distribution. One at a time, and at
      most one begins in a `draw_period`. A fault does nothing while the effort that causes it is taken back.
    - ``adhesion``: the wheel locks while the brake demanded is above `adhesion_limit`, and spins while traction is.

    A jam ends when `brake_released` was 1 for `release_time` in it; in ``drawn`` as well when its effort was taken back
    for so long; in ``adhesion`` the wheel takes up rolling in `release_time`. The 0.146 s are nominal: they follow from
    jams of 0.2 s that are cut to 0.15 s by a release 4 ms after their onset.

    `effort_loss` is the share of the effort that does not reach the rail, `jam_loss` times the depth of a jam,
    `skid_loss` times that of a skid; it belongs to the input of the same name of `longitudinal_train`.

    Args:
        cause: see above.
        fault_count: number of faults of ``given``.
        distance_from: ``speed``, or ``position``, which adds that input.

    Raises:
        ValueError: an unknown cause or source of the distance, or a count below one.

    Source: Aguiar Cota 2019, (2.29), Figs. 2-13 and 2-14, section 3.2.2.4; the causes, the time laws and the
    distributions are ours.
    """

    name = "wheel_fault"
    description = "Wheel that jams and skids, given, drawn or by adhesion: speed in, wheel speed and distance out"
    source = "Aguiar Cota 2019, (2.26)-(2.29), Figs. 2-13 and 2-14; causes and time laws are ours"
    internal_step = 1e-2  # the flow is exact for a held input, whatever the step
    purpose = Purpose.FAULTS
    outputs = (
        output_signal("wheel_speed", "m/s", "Circumferential speed of the wheel", display_unit="km/h"),
        output_signal("wheel_distance", "m", "Distance run by the wheel's rim"),
        output_signal("active", "1", "1 while the wheel jams or skids"),
        output_signal("depth", "1", "Share of the speed that is missing (jam < 0) or too much (skid > 0)"),
        output_signal("effort_loss", "1", "Share of the effort that does not reach the rail"),
        output_signal(
            "faults_unfinished",
            "1",
            "Number of given faults that are not over yet",
            warning=OutputWarning(
                "a given fault is not over when the run ends: a fault_length goes beyond the end, or a fault_onset "
                "lies there; shorten the fault, or let the run go on",
                ("faults_unfinished",),
                at_end=True,
            ),
        ),
    )
    presets: Mapping[str, Mapping[str, Any]] = {}
    option_choices: ClassVar[Mapping[str, Sequence[Any]]] = {
        "cause": ("given", "drawn", "adhesion"),
        "fault_count": range(1, 65),
        "distance_from": ("speed", "position"),
    }

    def __init__(self, *, cause: Cause = "given", fault_count: int = 4, distance_from: DistanceFrom = "speed") -> None:
        if cause not in self.option_choices["cause"]:
            raise ValueError(f"Unknown cause {cause!r}; choose one of: given, drawn, adhesion.")
        if distance_from not in self.option_choices["distance_from"]:
            raise ValueError(f"Unknown distance_from {distance_from!r}; choose one of: speed, position.")
        require_whole("wheel_fault", fault_count=fault_count)
        self._cause: FaultCause = (
            GivenFaults(fault_count) if cause == "given" else DrawnFaults() if cause == "drawn" else AdhesionFaults()
        )
        self.distance_from = distance_from
        self.inputs = (*_INPUTS, *((_POSITION,) if distance_from == "position" else ()))
        self.parameters = (*_SHARED, *self._cause.parameters)
        self.states = (_DISTANCE, *self._cause.continuous, *self._cause.remembered)
        self.switchings, self.events = self._cause.switchings, self._cause.events
        super().__init__(cause=cause, fault_count=fault_count, distance_from=distance_from)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Derivatives of the distance and of the states of the cause."""
        passed = self.switches(t, x, u, p)
        turning = 1.0 if self.distance_from == "speed" else 0.0  # else only what the fault adds is integrated here
        rate = u.speed * (turning + self._cause.fault(t, x, passed, u, p).depth)
        return {"rim_distance": rate, **self._cause.rates(t, x, passed, u, p)}

    def switching(self, t: Array, x: Any, u: Any, p: Any) -> Array:
        """Switching functions of the cause."""
        return vector(*self._cause.switching(t, x, u, p))

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """A fault is drawn, or none."""
        return self._cause.jump(t, x, u, p)

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The declared outputs."""
        depth, unfinished = self._cause.fault(t, x, self.switches(t, x, u, p), u, p)
        jammed, skidding = np.maximum(-depth, 0.0), np.maximum(depth, 0.0)
        return {
            "wheel_speed": u.speed * (1.0 + depth),
            "wheel_distance": x.rim_distance if self.distance_from == "speed" else u.position + x.rim_distance,
            "active": one_where(np.abs(depth) > 0.0),
            "depth": depth + 0.0 * x.rim_distance,
            "effort_loss": np.minimum(p.jam_loss * jammed + p.skid_loss * skidding, 1.0),
            "faults_unfinished": unfinished,
        }

    def requirements(self, p: Any) -> dict[str, Array]:
        """Parameters keep their bounds, and what the cause requires."""
        return {**within_bounds(self.parameters, p), **self._cause.requirements(p)}


_DISTANCE = state("rim_distance", "m", 0.0, "Distance run by the wheel's rim at start")
_SHARED = (
    parameter("release_time", "s", 0.146, "From the release of the brake to a wheel that rolls", min=1e-6),
    parameter("jam_loss", "1", 0.0, "Share of the effort that is lost in a full jam", min=0.0, max=1.0),
    parameter("skid_loss", "1", 0.0, "Share of the effort that is lost in a skid of depth 1", min=0.0, max=1.0),
)
_INPUTS = (
    input_signal("speed", "m/s", 0.0, "Circumferential speed of the wheel without the fault", display_unit="km/h"),
    input_signal("effort", "N", 0.0, "Effort demanded of the train: traction > 0, brake < 0"),
    input_signal("adhesion_limit", "N", UNLIMITED, "Largest force that the rails can take", optional=True),
    input_signal("brake_released", "1", 0.0, "1 while the brake is released because of a fault", optional=True),
)
_POSITION = input_signal("position", "m", 0.0, "Position of the train")
