"""Telegrams: what the on-board receives of a crossing, when, and what goes wrong on the way.

A telegram carries its stamp and the odometer reading at the crossing, and arrives a latency later. Some balises are
missed, some telegrams are false. All chance comes from (seed, number of the crossing) and from nothing else.
"""

from __future__ import annotations

from bisect import bisect_right, insort
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import inf, nan
from operator import attrgetter
from types import MappingProxyType
from typing import Generic, TypeVar

from cosim.balises.event_message import EventMessage, Sent
from cosim.errors import ScenarioError
from cosim.results.result import BaliseRecord
from plant_models.hybrid.noise import Purpose, standard_normal, uniform_pair

T = TypeVar("T", bound=Sent)
_delivery, _instant = attrgetter("delivered_at", "stamp"), attrgetter("delivered_at")
NO_OUTCOMES: Mapping[str, str] = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class Crossing:
    """The train over a balise.

    Args:
        stamp: when [s]. position: where the plant was [m]. identity: of the balise. location_accuracy: Q_LOCACC [m].
        method: localisation method. time_bound: bound or estimate of the stamp's error [s], NaN where it is not known.
    """

    stamp: float
    position: float
    identity: str
    location_accuracy: float = 0.0
    method: str = ""
    time_bound: float = 0.0


@dataclass(frozen=True)
class FalseTelegram:
    """A telegram without a balise: delivered at `time` [s], claiming a position `offset` metres from the true one."""

    time: float
    offset: float


@dataclass(frozen=True)
class Channel:
    """What happens between a balise and the on-board.

    Args:
        latency: delay from crossing to delivery [s].
        latency_jitter: further delay, uniform in [0, jitter] [s]; telegrams may overtake each other.
        missed_fraction: probability that a balise is not read.
        missed: identities of balises that are not read.
        position_noise: standard deviation of the reported position as a share of the location accuracy.
        false_telegrams: telegrams without a balise.
        seed: seed of all chance here.
    """

    latency: float = 0.0
    latency_jitter: float = 0.0
    missed_fraction: float = 0.0
    missed: frozenset[str] = frozenset()
    position_noise: float = 0.0
    false_telegrams: tuple[FalseTelegram, ...] = ()
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("latency", "latency_jitter", "missed_fraction", "position_noise"):
            if not 0.0 <= getattr(self, name) < inf:
                raise ScenarioError(f"balises.{name} must not be negative, got {getattr(self, name)!r}.")
        if self.missed_fraction > 1.0:
            raise ScenarioError(f"balises.missed_fraction is a probability, got {self.missed_fraction!r}.")

    def transmit(
        self, crossing: Crossing, number: int, odometer_reading: float, outcomes: Mapping[str, str] = NO_OUTCOMES
    ) -> BaliseRecord:
        """The telegram of crossing `number`; `delivered_at` is NaN where the balise is missed.

        Args:
            crossing: of the balise. number: of the crossing. odometer_reading: there [m/s].
            outcomes: what became of it, where that is known already.
        """
        chance = self.missed_fraction > 0.0 or self.latency_jitter > 0.0
        luck, jitter = uniform_pair(self.seed, 0, number, Purpose.TELEGRAMS) if chance else (1.0, 0.0)
        missed = luck < self.missed_fraction or crossing.identity in self.missed
        spread = self.position_noise * crossing.location_accuracy
        noise = spread * standard_normal(self.seed, 1, number, Purpose.TELEGRAMS) if spread > 0.0 else 0.0
        return BaliseRecord(
            stamp=crossing.stamp,
            delivered_at=nan if missed else crossing.stamp + self.latency + jitter * self.latency_jitter,
            identity=crossing.identity,
            position=crossing.position + noise,
            true_position=crossing.position,
            location_accuracy=crossing.location_accuracy,
            odometer_reading=odometer_reading,
            kind="missed" if missed else "true",
            method=crossing.method,
            time_bound=crossing.time_bound,
            outcomes=outcomes,
        )


@dataclass
class Mailbox(Generic[T]):
    """Telegrams, or packets of a network, on their way, in order of delivery, and a record of all of them."""

    waiting: list[T] = field(default_factory=list)
    log: list[T] = field(default_factory=list)

    def post(self, telegram: T) -> None:
        """Put a telegram on its way; a missed or lost one is only logged."""
        if telegram.kind in ("missed", "lost"):
            self.log.append(telegram)
            return
        insort(self.waiting, telegram, key=_delivery)

    def due(self, until: float) -> list[T]:
        """Take out what is delivered at or before `until` [s]."""
        count = bisect_right(self.waiting, until, key=_instant)
        taken, self.waiting = self.waiting[:count], self.waiting[count:]
        return taken

    def delivered(self, telegram: T, outcomes: Mapping[str, str]) -> dict[str, str]:
        """Log a delivered telegram with what became of it.

        Args:
            outcomes: by receiver.

        Returns:
            The outcomes in the log, where those that are known later only can be written.
        """
        logged = dict(outcomes)
        self.log.append(replace(telegram, outcomes=logged))  # type: ignore[type-var] # all are data classes
        return logged


PAYLOAD = ("position", "location_accuracy", "odometer_reading", "delivered_at")
_of_telegram = attrgetter(*PAYLOAD)


def payload(telegram: BaliseRecord | EventMessage) -> Mapping[str, float]:
    """The numeric fields of a telegram, by the names a receiver may declare as ``balise_<field>``; of a message its
    own.
    """
    if isinstance(telegram, EventMessage):
        return telegram.payload
    return dict(zip(PAYLOAD, _of_telegram(telegram), strict=True))
