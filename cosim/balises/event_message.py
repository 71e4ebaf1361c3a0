"""Messages: what a receiver is notified of at an event, whoever sends it: a balise or a node of a network."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol


class Sent(Protocol):
    """Something on its way: true at its stamp, delivered later."""

    @property
    def stamp(self) -> float:
        """When it was true [s]."""

    @property
    def delivered_at(self) -> float:
        """When it arrives [s]."""

    @property
    def kind(self) -> str:
        """What it is; ``missed`` and ``lost`` never arrive."""


@dataclass(frozen=True, slots=True)
class EventMessage:
    """A message to one receiver.

    Args:
        event: of the receiver. stamp: when its values were true [s]. delivered_at: when it arrives [s].
        payload: values by field of the event.
    """

    event: str
    stamp: float
    delivered_at: float
    payload: Mapping[str, float]
