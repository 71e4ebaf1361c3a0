"""Events of the members of a batch that are still to come, in the order in which the compiled loop takes them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fmus.batch.error import BatchError
from plant_models.hybrid import HybridSystem, TriggeredEvent, scalar_names

TIME_TOLERANCE = 1e-9
"""Closer in time than this [s] is the same instant, as in the C runtime."""


@dataclass(frozen=True)
class Schedule:
    """Events sorted by member and then by stamp, shape (k,) each; of equal stamps the one announced first stays first.

    Args:
        members: number of the member. kinds: number of the triggered event. stamps: when it happens [s].
        payloads: shape (k, longest payload), in declared order.
    """

    members: np.ndarray
    kinds: np.ndarray
    stamps: np.ndarray
    payloads: np.ndarray

    @classmethod
    def nothing(cls, system: HybridSystem) -> Schedule:
        """No events.

        Args:
            system: whose events they would be.
        """
        longest = max((len(scalar_names(e.payload)) for e in system.triggered_events), default=0)
        whole = np.zeros(0, dtype=np.int64)
        return cls(whole, whole, np.zeros(0), np.zeros((0, longest)))

    @classmethod
    def of(
        cls, system: HybridSystem, event: str, members: ArrayLike, stamps: ArrayLike, payload: Mapping[str, ArrayLike]
    ) -> Schedule:
        """Events of one kind in the order given.

        Args:
            system: that declares them. event, members, stamps, payload: as for `Batch.notify`.

        Raises:
            BatchError: there is no such event or payload, or the shapes do not fit.
        """
        kind, declared = _declared(system, event)
        names = scalar_names(declared.payload)
        known = {name.removeprefix(f"{event}_"): i for i, name in enumerate(names)}
        starts = dict(zip(scalar_names(system.input_signals), system.start_inputs(), strict=True))
        try:
            numbers, instants, *columns = np.broadcast_arrays(
                np.atleast_1d(np.asarray(members, dtype=np.int64)),
                np.asarray(stamps, dtype=float),
                *(np.asarray(values, dtype=float) for values in payload.values()),
            )
        except (ValueError, TypeError) as error:
            raise BatchError(f"Event {event}: members, stamps and payload do not fit each other: {error}.") from None
        payloads = np.zeros((len(numbers), cls.nothing(system).payloads.shape[1]))
        payloads[:, : len(names)] = [starts[name] for name in names]
        for name, column in zip(payload, columns, strict=True):
            short = name.removeprefix(f"{event}_")
            if short not in known:
                raise BatchError(f"Event {event} has no payload {name!r}; it has: {', '.join(known) or 'none'}.")
            payloads[:, known[short]] = column
        return cls(numbers, np.full(len(numbers), kind, dtype=np.int64), instants, payloads)

    def check(self, members: int, now: float | None) -> None:
        """Refuse members that do not exist and stamps that cannot come.

        Args:
            members: how many there are. now: time of the batch [s], None before it has begun.

        Raises:
            BatchError: there is such a one.
        """
        strange = self.members[(self.members < 0) | (self.members >= members)]
        if len(strange):
            raise BatchError(f"There is no member {strange[0]}; the last one is {members - 1}.")
        late = ~np.isfinite(self.stamps) | (self.stamps < (-np.inf if now is None else now - TIME_TOLERANCE))
        if late.any():
            i = int(np.argmax(late))
            raise BatchError(
                f"Member {self.members[i]}: an event at {self.stamps[i]:g} s cannot come any more"
                + ("." if now is None else f": the members stand at {now:g} s. Announce events before they happen.")
            )

    def without(self, next_events: Sequence[int]) -> Schedule:
        """What has not happened yet.

        Args:
            next_events: position of the next event of each member.
        """
        waits = np.arange(len(self.members)) >= np.asarray(next_events, dtype=np.int64)[self.members]
        return Schedule(self.members[waits], self.kinds[waits], self.stamps[waits], self.payloads[waits])

    def joined(self, later: Schedule) -> Schedule:
        """These and those announced later, sorted."""
        pairs = zip(
            (self.members, self.kinds, self.stamps, self.payloads),
            (later.members, later.kinds, later.stamps, later.payloads),
            strict=True,
        )
        members, kinds, stamps, payloads = (np.concatenate(pair) for pair in pairs)
        order = np.lexsort((stamps, members))  # stable
        return Schedule(*(np.ascontiguousarray(part[order]) for part in (members, kinds, stamps, payloads)))


def _declared(system: HybridSystem, name: str) -> tuple[int, TriggeredEvent]:
    for number, event in enumerate(system.triggered_events):
        if event.name == name:
            return number, event
    known = ", ".join(event.name for event in system.triggered_events) or "none"
    raise BatchError(f"{system.name} has no triggered event {name!r}; it has: {known}.")
