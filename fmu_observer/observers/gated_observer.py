"""Base of every observer that gets balises: what all of them do with a telegram before they believe it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar, Literal, TypeGuard

import numpy as np

from fmu_observer.observers.innovation_gate import (
    GATE_MEMORY,
    GATE_PARAMETERS,
    REJECT,
    VERDICT,
    GateMemory,
    ReportedPlace,
    evaluate,
)
from plant_models.hybrid import Array, Event, HybridSystem, TriggeredEvent, input_signal
from plant_models.hybrid.missing import or_else
from plant_models.hybrid.signal import within_bounds

GATED_EVENT = "balise"
_REPORTED_POSITION = "balise_position"
_LOCATION_ACCURACY = input_signal(
    "balise_location_accuracy",
    "m",
    0.0,
    "Location accuracy of the balise just passed, either way; 0: not told",
    variability="discrete",
)
_Weighing = Literal["innovation", "position", "itself"]


class GatedObserver(HybridSystem):
    """A hybrid system whose `balise` telegrams pass an innovation gate; without that event it is as any other.

    The contract:

    1. A subclass declares the event `balise` with the payload `balise_position`, and the position it believes is the
       state `position_state`, the first one unless it says so. It writes `update` in place of `jump`.
    2. The gate's memory stands behind all states, its parameters behind all parameters, and the payload of the event
       gets `balise_location_accuracy`. What became of a telegram is the event's `verdict`.
    3. `odometer_of`, `own_bound` and `listens` say what the gate may know more of the observer, `gate_start` what
       `gate` is where nobody sets it.
    4. `weighing` says how the accuracy of a telegram weighs it. ``innovation``: the observer sees the innovation times
       the weight of the gate, so its gain is scaled down by it, and never up. ``position``: at a balise it sets
       `weighed_states`, and they go to that value by the weight. ``itself``: it has a variance of the place, and
       `place_deviation` gives it.

    Args:
        options: of the observer, see its `option_choices`.
    """

    position_state: str = ""
    gate_start: float = REJECT
    weighing: _Weighing = "innovation"
    weighed_states: ClassVar[tuple[str, ...]] = ("estimated_position",)

    def __init__(self, **options: Any) -> None:
        self.position_state = self.position_state or self.states[0].name
        self.gated = any(_is_gated(event) for event in self.events)
        if self.gated:
            self.states = (*self.states, *GATE_MEMORY)
            self.parameters = (
                *self.parameters,
                *(replace(s, start=self.gate_start) if s.name == "gate" else s for s in GATE_PARAMETERS),
            )
            self.events = tuple(_evaluated(event) if _is_gated(event) else event for event in self.events)
        super().__init__(**options)

    # -- what a subclass writes -------------------------------------------------------------------------------------

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """New values of the own states that an event changes, by name; a telegram here is one to be used."""
        raise NotImplementedError(f"{type(self).__name__} declares event {event!r} but has no update for it.")

    def odometer_of(self, u: Any) -> Array | None:
        """The odometer at the telegram [m/s], by default the input `odometer`; None where the observer has none."""
        return getattr(u, "odometer", None)

    def own_bound(self, x: Any, p: Any) -> Array:
        """What the observer itself says its position may be off [m], of a covariance, say; zero where it does not."""
        return 0.0

    def listens(self, p: Any) -> Array:
        """Whether balises act on the estimate at all with these parameters, 1 or 0."""
        return 1.0

    # -- what follows -----------------------------------------------------------------------------------------------

    def requirements(self, p: Any) -> dict[str, Array]:
        """Bounds of the gate's parameters, and what `HybridSystem.requirements` says."""
        return within_bounds(GATE_PARAMETERS if self.gated else (), p) | super().requirements(p)

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """`update`, where the gate lets the telegram pass."""
        evaluates = self.gated and event == GATED_EVENT
        return self._evaluated_update(t, x, u, p) if evaluates else self.update(event, t, x, u, p)

    def _evaluated_update(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        estimate = getattr(x, self.position_state)
        gate = GateMemory(*(getattr(x, s.name) for s in GATE_MEMORY))
        odometer = self.odometer_of(u)
        if odometer is not None:  # where it is missing, the one at the telegram before is the last that is known
            odometer = or_else(odometer, gate.last_odometer)
        report = ReportedPlace(
            u.balise_position, u.balise_location_accuracy, estimate, self.own_bound(x, p), odometer, t
        )
        evaluated, listens = evaluate(gate, report, p), self.listens(p)
        used = np.where(listens > 0.0, evaluated.used, 1.0)
        begun = np.where(listens * evaluated.restart > 0.0, u.balise_position, estimate)
        after = self._weighed_update(t, x._replace(**{self.position_state: begun}), u, p, evaluated.weight)
        remembered = zip(GATE_MEMORY, evaluated.memory, gate, strict=True)
        return {name: np.where(used > 0.0, value, getattr(x, name)) for name, value in after.items()} | {
            s.name: np.where(listens > 0.0, new, old) for s, new, old in remembered
        }

    def _weighed_update(self, t: Array, x: Any, u: Any, p: Any, weight: Array) -> dict[str, Array]:
        """`update` at a telegram that weighs so much [1]; at least the position afterwards."""
        estimate, reported = getattr(x, self.position_state), u.balise_position
        if self.weighing == "innovation":
            u = u._replace(balise_position=_towards(estimate, reported, weight))
        after = {self.position_state: estimate} | self.update(GATED_EVENT, t, x, u, p)
        if self.weighing == "position":
            after |= {name: _towards(getattr(x, name), after[name], weight) for name in self.weighed_states}
        return after


def _towards(own: Array, reported: Array, weight: Array) -> Array:
    """What is reported, to the bit, where it weighs one."""
    return np.where(weight < 1.0, own + weight * (reported - own), reported)


def _is_gated(event: Event) -> TypeGuard[TriggeredEvent]:
    return (
        event.name == GATED_EVENT
        and isinstance(event, TriggeredEvent)
        and _REPORTED_POSITION in (s.name for s in event.payload)
    )


def _evaluated(event: TriggeredEvent) -> TriggeredEvent:
    accuracy = () if _LOCATION_ACCURACY.name in (s.name for s in event.payload) else (_LOCATION_ACCURACY,)
    return replace(event, payload=(*event.payload, *accuracy), verdict=VERDICT)
