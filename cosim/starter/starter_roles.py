"""Roles: what the signals of an FMU can be in a scenario with a train, an odometer, a driver and an observer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from cosim.run.balise_service import BALISE_EVENT
from cosim.starter.guessed_signal import Guess, Quantity, guess
from cosim.starter.inspected_fmu import InspectedFmu


@dataclass(frozen=True)
class PlantRoles:
    """Guesses for a plant; None for what was not found.

    Args:
        position, speed, wheel_speed: outputs. effort: input that drives the train. applied: output that reports the
            effort, where no input does. slip, adhesion: outputs for the report. mass: parameter.
    """

    position: Guess | None
    speed: Guess | None
    wheel_speed: Guess | None
    effort: Guess | None
    applied: Guess | None
    slip: Guess | None
    adhesion: Guess | None
    mass: Guess | None

    @property
    def is_train(self) -> bool:
        """Whether there is enough for an odometer: a speed, named so or beside a position or an effort."""
        seen = [g for g in (self.speed, self.wheel_speed) if g is not None]
        return any(g.sureness != "a guess" for g in seen) or (bool(seen) and self.position is not None)


@dataclass(frozen=True)
class ObserverRoles:
    """Guesses for an observer: its inputs."""

    effort: Guess | None
    odometer: Guess | None


def plant_roles(inspected: InspectedFmu) -> PlantRoles:
    """Guesses for an FMU as a plant.

    Args:
        inspected: what the FMU says of itself.
    """
    wheel = _seen("wheel_speed", inspected)
    taken = [] if wheel is None else [wheel.signal.name]
    effort = guess("effort", inspected.inputs)
    speed = _seen("speed", inspected, taken)
    part = "" if speed is None else speed.signal.name.rpartition(".")[0]
    return PlantRoles(
        position=_seen("position", inspected, part=part),
        speed=speed,
        wheel_speed=wheel,
        effort=effort,
        applied=None if effort is not None else guess("effort", inspected.outputs),
        slip=guess("slip", inspected.outputs),
        adhesion=guess("adhesion_force", inspected.outputs),
        mass=guess("mass", inspected.parameters),
    )


def _seen(quantity: Quantity, inspected: InspectedFmu, taken: Sequence[str] = (), part: str = "") -> Guess | None:
    """A guess among the outputs or, where none fits, among the local variables: sealed FMUs hide what others need."""
    found = guess(quantity, inspected.outputs, taken, part)
    if found is not None and found.sureness != "a guess":
        return found
    hidden = guess(quantity, [s for s in inspected.hidden if s.meaning is not None], taken, part)
    if hidden is None or hidden.sureness == "a guess":
        return found
    return replace(hidden, reason=f"{hidden.reason}; a local variable, read like an output")


def is_observer(inspected: InspectedFmu) -> bool:
    """Whether the FMU is notified of balises, as observers are.

    Args:
        inspected: what the FMU says of itself.
    """
    return BALISE_EVENT in inspected.component.events


def observer_roles(inspected: InspectedFmu) -> ObserverRoles:
    """Guesses for an FMU as an observer: its odometer may be called that, or just speed.

    Args:
        inspected: what the FMU says of itself.
    """
    return ObserverRoles(
        guess("effort", inspected.inputs), guess("wheel_speed", inspected.inputs) or guess("speed", inspected.inputs)
    )
