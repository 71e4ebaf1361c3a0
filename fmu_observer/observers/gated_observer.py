"""Base of every observer that is told of balises: what all of them do with a telegram before they believe it."""

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
    Told,
    judge,
)
from plant_models.hybrid import Event, HybridSystem, Signal, TriggeredEvent, input_signal, vector, width
from plant_models.hybrid.missing import or_else
from plant_models.hybrid.requirements import within_bounds
from plant_models.hybrid.system import Array

GATED_EVENT = "balise"
TOLD_POSITION = "balise_position"
LOCATION_ACCURACY = input_signal(
    "balise_location_accuracy",
    "m",
    0.0,
    "Location accuracy of the balise just passed, either way; 0: not told",
    variability="discrete",
)
Weighing = Literal["innovation", "position", "itself"]


class GatedObserver(HybridSystem):
    """A hybrid system whose `balise` telegrams pass an innovation gate; without that event it is as any other.

    The contract:

    1. A subclass declares the event `balise` with the payload `balise_position`, and the position it believes is the
       state `position_state`. It writes `update` in place of `jump`, and sees there its own states only.
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

    position_state: int = 0
    gate_start: float = REJECT
    weighing: Weighing = "innovation"
    weighed_states: ClassVar[tuple[int, ...]] = (0,)

    def __init__(self, **options: Any) -> None:
        self.own_count = width(self.states)
        self.gated = any(_is_gated(event) for event in self.events)
        if self.gated:
            self.states = (*self.states, *GATE_MEMORY)
            self.parameters = (
                *self.parameters,
                *(replace(s, start=self.gate_start) if s.name == "gate" else s for s in GATE_PARAMETERS),
            )
            self.events = tuple(_judged(event) if _is_gated(event) else event for event in self.events)
        super().__init__(**options)

    # -- what a subclass writes -------------------------------------------------------------------------------------

    def update(self, event: str, t: Array, x: Array, u: Any, p: Any) -> Array:
        """Own states after an event, shape (own_count,), of the own states before it; a telegram here is one to be
        used.
        """
        raise NotImplementedError(f"{type(self).__name__} declares event {event!r} but has no update for it.")

    def odometer_of(self, u: Any) -> Array | None:
        """The odometer at the telegram [m/s]; None where the observer has none."""
        return None

    def own_bound(self, x: Array, p: Any) -> Array:
        """What the observer itself says its position may be off [m], of a covariance, say; zero where it does not."""
        return 0.0

    def listens(self, p: Any) -> Array:
        """Whether balises act on the estimate at all with these parameters, 1 or 0."""
        return 1.0

    # -- what follows -----------------------------------------------------------------------------------------------

    def requirements(self, p: Any) -> dict[str, Array]:
        """Bounds of the gate's parameters, see `HybridSystem.requirements`."""
        return super().requirements(p) | (within_bounds(GATE_PARAMETERS, p) if self.gated else {})

    def jump(self, event: str, t: Array, x: Array, u: Any, p: Any) -> Array:
        """`update`, where the gate lets the telegram pass; shape (n,)."""
        own, gate = [x[i] for i in range(self.own_count)], [x[i] for i in range(self.own_count, x.shape[0])]
        if not self.gated or event != GATED_EVENT:
            after = self.update(event, t, vector(*own), u, p)
            return vector(*(after[i] for i in range(self.own_count)), *gate)
        estimate = own[self.position_state]
        before, odometer = GateMemory(*gate), self.odometer_of(u)
        if odometer is not None:  # where it is missing, the one at the telegram before is the last that is known
            odometer = or_else(odometer, before.last_odometer)
        place, accuracy, own_bound = u.balise_position, u.balise_location_accuracy, self.own_bound(x, p)
        judged = judge(before, Told(place, accuracy, estimate, own_bound, odometer, t), p)
        listens = self.listens(p)
        used = np.where(listens > 0.0, judged.used, 1.0)
        kept = list(own)
        kept[self.position_state] = np.where(listens * judged.restart > 0.0, u.balise_position, estimate)
        after = self._weighed_update(t, kept, u, p, judged.weight)
        return vector(
            *(np.where(used > 0.0, after[i], own[i]) for i in range(self.own_count)),
            *(np.where(listens > 0.0, new, old) for new, old in zip(judged.memory, gate, strict=True)),
        )

    def _weighed_update(self, t: Array, own: list[Array], u: Any, p: Any, weight: Array) -> list[Array]:
        """`update` at a telegram that weighs so much [1]; own states afterwards."""
        estimate, told = own[self.position_state], u.balise_position
        if self.weighing == "innovation":
            u = u._replace(balise_position=_towards(estimate, told, weight))
        updated = self.update(GATED_EVENT, t, vector(*own), u, p)
        after = [updated[i] for i in range(self.own_count)]
        if self.weighing == "position":
            for i in self.weighed_states:
                after[i] = _towards(own[i], after[i], weight)
        return after


def _towards(own: Array, told: Array, weight: Array) -> Array:
    """What is told, to the bit, where it weighs one."""
    return np.where(weight < 1.0, own + weight * (told - own), told)


def _is_gated(event: Event) -> TypeGuard[TriggeredEvent]:
    return (
        event.name == GATED_EVENT
        and isinstance(event, TriggeredEvent)
        and TOLD_POSITION in (s.name for s in event.payload)
    )


def _judged(event: TriggeredEvent) -> TriggeredEvent:
    accuracy = () if LOCATION_ACCURACY.name in (s.name for s in event.payload) else (LOCATION_ACCURACY,)
    return replace(event, payload=(*event.payload, *accuracy), verdict=VERDICT)


def is_gate_parameter(signal: Signal) -> bool:
    """Whether a parameter is one of the gate, which no question of stability depends on.

    Args:
        signal: a parameter.
    """
    return signal.name in {s.name for s in GATE_PARAMETERS}
