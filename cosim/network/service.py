"""The network of a run: nodes send at their instants, packets arrive, receivers are notified or hold what came last.

Transmissions and deliveries are instants to which all components are stepped, so what is measured and delivered does
not depend on the communication step, nor on the order in which components are stepped.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from math import inf, nan
from typing import Any

import numpy as np

from cosim.balises.delivery import Delivery, Receiver
from cosim.balises.event_message import EventMessage
from cosim.balises.telegram import Mailbox
from cosim.coupling.chain import Mover, Position, Stage, around
from cosim.coupling.plan import Plan
from cosim.network.chance import Chance
from cosim.network.outputs import PacketReader
from cosim.network.settings import NetworkSettings
from cosim.results.result_data import PacketRecord
from fmus.fmi.standard import TIME_TOLERANCE
from plant_models.railway.network.protocols import periodic_sender, quadratic_sender

PACKET_STAGE_TEXT = "packet receiver"


@dataclass(frozen=True, slots=True)
class _Packet:
    """A packet on its way.

    Args:
        stamp: when its values were measured and it was sent [s]. delivered_at: when it arrives [s].
        node: number of its node, from 0. number: of the transmission, from 0. values: of the node's signals, in order.
        kind: ``sent``, ``lost`` or ``duplicate``; ``gap``: here a lost one would arrive. place: in the log.
    """

    stamp: float
    delivered_at: float
    node: int
    number: int
    values: tuple[float, ...]
    kind: str
    place: int


@dataclass(frozen=True)
class Field:
    """What one field of an event takes.

    Args:
        name: of the field. signal: number of the signal. factor, offset: conversion of units.
    """

    name: str
    signal: int
    factor: float = 1.0
    offset: float = 0.0


@dataclass
class PacketListener:
    """A component that is notified of packets by an event of its own.

    Args:
        component: its name. event: by which it is notified. fields: that take signals. nodes: whose packets it gets.
    """

    component: str
    event: str
    fields: tuple[Field, ...]
    nodes: frozenset[int]
    receiver: Receiver | None = field(default=None, repr=False)


@dataclass(slots=True)
class _SentPacket:
    """One packet in the log.

    Args:
        packet: as it was sent. deliveries: by receiver, once it has arrived.
    """

    packet: _Packet
    deliveries: dict[str, Delivery | str] = field(default_factory=dict)


class NetworkService:
    """The network.

    Args:
        settings: what it is. start: of the run [s].
        sources: columns of the measured signals in the values of the plan, shape (p,).
        first: column of the network's own outputs.
        listeners: components that are notified by events. holders: by signal the components whose inputs hold it.
        readers: inputs for which what arrives is an output too, behind the others.
    """

    def __init__(
        self,
        settings: NetworkSettings,
        start: float,
        sources: np.ndarray,
        first: int,
        listeners: Sequence[PacketListener],
        holders: Mapping[str, Sequence[str]],
        readers: Sequence[PacketReader] = (),
    ) -> None:
        self.settings, self.sources, self.listeners = settings, sources, list(listeners)
        self.chance, self._readers = Chance(settings, start), list(readers)
        count, nodes = len(sources), len(settings.nodes)
        self._place_outputs(first, count, nodes)
        self._sampled = np.array([reader.signal for reader in readers], dtype=np.intp)
        self._reads = [reader.next_sample(start, start) for reader in readers]  # a packet at the start, as it were
        node_of = np.array(settings.node_of)
        self._own = [np.flatnonzero(node_of == i) for i in range(nodes)]
        self._order = settings.order or tuple(range(nodes))
        self._by_name = sorted(range(nodes), key=lambda i: settings.nodes[i].name)
        self._weights = None if settings.weights is None else settings.weights[self._by_name]
        self._holding = [
            sorted({name for signal in node.signals for name in holders.get(signal, ())}) for node in settings.nodes
        ]
        self.mailbox: Mailbox[_Packet] = Mailbox()
        self.entries: list[_SentPacket] = []
        self.number = 0
        self._start, self._begun = start, False
        self._next = self.chance.instant(0)
        self._sent = np.zeros(count)
        self._newest = [-1] * nodes
        self._arrived: list[set[int]] = [set() for _ in range(nodes)]
        self._receivers: list[Receiver] = []

    def _place_outputs(self, first: int, count: int, nodes: int) -> None:
        """Columns of the outputs, from `first` on: of signals, their errors, the sender, the nodes' stamps, readers."""
        self._held = slice(first, first + count)
        self._errors = slice(first + count, first + 2 * count)
        self._sender, self._stamps = first + 2 * count, slice(first + 2 * count + 1, first + 2 * count + 1 + nodes)
        behind = first + 2 * count + 1 + nodes
        self._arriving = slice(behind, behind + len(self._readers))

    def attach(self, plan: Plan, known: Sequence[Receiver] = ()) -> None:
        """Take a place in the plan: values are measured in it, and receivers that are behind get theirs in their steps.

        Args:
            plan: of the run. known: receivers of balises, which keep what they receive of packets as well.
        """
        self._plan = plan
        by_name = {receiver.planned.component.name: receiver for receiver in known}
        for listener in self.listeners:
            name = listener.component
            if name not in by_name:
                receiver = by_name[name] = Receiver(plan.find(name), listener.event)
                stage = Stage(Position.BALISES, PACKET_STAGE_TEXT, move=around(partial(self._move, receiver)))
                receiver.planned.add_stage(stage)
                self._receivers.append(receiver)
            listener.receiver = by_name[name]
        plan.relays.append(self._relay)

    @property
    def next_instant(self) -> float:
        """When something is sent, arrives, or has been read next [s]."""
        arrives = self.mailbox.waiting[0].delivered_at if self.mailbox.waiting else inf
        return min(self._next, arrives, *self._reads)

    @property
    def idle_until(self) -> float:
        """Up to here [s] nothing is to be done for it."""
        if any(listener.receiver is not None and listener.receiver.busy for listener in self.listeners):
            return -inf
        return self.next_instant

    def is_due(self, t: float) -> bool:
        """Whether something is sent, arrives, or has been read at `t` [s]."""
        return self.next_instant <= t + TIME_TOLERANCE

    def handle(self, t: float) -> None:
        """All components stand at `t` [s]: what they have read is no new reading; send what is due, then deliver it."""
        if not self._begun:
            self._begin()
        for place, read_at in enumerate(self._reads):
            if read_at <= t + TIME_TOLERANCE:
                self._plan.values[self._arriving][place], self._reads[place] = nan, inf
        while self._next <= t + TIME_TOLERANCE:
            self._transmit(t)
        for packet in self.mailbox.due(t + TIME_TOLERANCE):
            self._deliver(t, packet)

    # -- sending ----------------------------------------------------------------------------------------------------

    def _relay(self) -> None:
        """Before the run begins receivers hold what is measured, as if the network had run for long."""
        values = self._plan.values
        values[self._held] = values[self.sources]
        values[self._errors] = 0.0
        values[self._sender] = 0.0
        values[self._stamps] = self._start
        values[self._arriving] = values[self._held][self._sampled]

    def _begin(self) -> None:
        self._begun = True
        self._sent[:] = np.nan_to_num(self._plan.values[self._held])

    def _transmit(self, t: float) -> None:
        """Transmission `number`, now: one node sends what it measures."""
        k, values = self.number, self._plan.values
        stamp = self._next
        measured = values[self.sources]
        there = ~np.isnan(measured)  # what is missing was sent before as well as it can be
        error = np.where(there, self._sent - measured, 0.0)
        values[self._errors] = error
        if self._weights is None:
            node = periodic_sender(self._order, k)
        else:  # of nodes with equal errors the first by name, however they are listed
            node = self._by_name[quadratic_sender(self._weights, error)]
        own = self._own[node]
        self._sent[own] = np.where(there[own], measured[own], self._sent[own])
        values[self._sender] = node + 1.0
        self.number, self._next = k + 1, self.chance.instant(k + 1)
        sent = tuple(measured[own].tolist())
        lost, arrives = self.chance.lost(k), stamp + self.chance.delay(k)
        self._post(_Packet(stamp, arrives, node, k, sent, "lost" if lost else "sent", len(self.entries)))
        if not lost and self.chance.is_doubled(k):
            arrives = stamp + self.chance.delay(k, second=True)
            self._post(_Packet(stamp, arrives, node, k, sent, "duplicate", len(self.entries)))

    def _post(self, packet: _Packet) -> None:
        lost = packet.kind == "lost"
        self.entries.append(_SentPacket(replace(packet, delivered_at=nan) if lost else packet))
        if not lost or np.isin(self._own[packet.node], self._sampled).any():
            self.mailbox.post(replace(packet, kind="gap") if lost else packet)

    # -- delivering -------------------------------------------------------------------------------------------------

    def _deliver(self, t: float, packet: _Packet) -> None:
        node, values, entry = packet.node, self._plan.values, self.entries[packet.place]
        checked = self.settings.sequence == "checked"
        again = packet.number in self._arrived[node]
        older = packet.number <= self._newest[node]
        kept = not (checked and older)
        if packet.kind == "gap":
            if kept:
                self._arrive(t, node, np.full(len(self._own[node]), nan))
            return
        if self.settings.duplicate_fraction > 0.0:
            self._arrived[node].symmetric_difference_update({packet.number})  # of two copies the second is the last
        if kept:
            values[self._held][self._own[node]] = packet.values
            self._arrive(t, node, np.array(packet.values))
            values[self._stamps][node] = packet.stamp
            self._newest[node] = packet.number
        for name in self._holding[node]:
            entry.deliveries[name] = "held" if kept else "dropped"
        for listener in self.listeners:
            if node not in listener.nodes or listener.receiver is None:
                continue
            if checked and again:
                entry.deliveries[listener.component] = "dropped"
            else:
                message = self._message(listener, packet)
                delivery = entry.deliveries[listener.component] = listener.receiver.notify(t, message)
                delivery.before = delivery.after = None  # rows show it; a log of a long run has no room for it

    def _arrive(self, t: float, node: int, brought: np.ndarray) -> None:
        """Those that leave out what is missing take what a packet of a node brought, NaN where it was lost, until they
        have read it.
        """
        received = dict(zip(self._own[node].tolist(), brought.tolist(), strict=True))
        for place, reader in enumerate(self._readers):
            if reader.signal in received:
                self._plan.values[self._arriving][place] = received[reader.signal]
                self._reads[place] = reader.next_sample(t, self._start)

    def _message(self, listener: PacketListener, packet: _Packet) -> EventMessage:
        """What a listener receives: the values of the packet, and of other nodes what was last received."""
        values = self._plan.values[self._held].copy()
        values[self._own[packet.node]] = packet.values
        received = {f.name: f.factor * float(values[f.signal]) + f.offset for f in listener.fields}
        own = {"node": packet.node + 1.0, "number": float(packet.number), "delivered_at": packet.delivered_at}
        return EventMessage(listener.event, packet.stamp, packet.delivered_at, own | received)

    def _move(self, receiver: Receiver, drive: Mover, t: float, until: float) -> None:
        """A receiver that is behind with what was delivered to it is notified in its step."""
        if receiver.busy:
            receiver.step(t, until, ())
        else:
            drive(t, until)

    # -- what came out ----------------------------------------------------------------------------------------------

    def settled(self, first: int) -> list[PacketRecord]:
        """Packets in the order of sending, up to the first that is still on its way or not yet used by its receiver.

        Args:
            first: number of packets at the begin that are left out.
        """
        until = min((packet.place for packet in self.mailbox.waiting), default=len(self.entries))
        if any(listener.receiver is not None and listener.receiver.busy for listener in self.listeners):
            return []
        return self.records(first, until)

    def records(self, first: int = 0, until: int | None = None) -> list[PacketRecord]:
        """Packets in the order of sending, duplicates behind theirs.

        Args:
            first: number of packets at the begin that are left out. until: number of the first that is left out behind.
        """
        names = [node.signals for node in self.settings.nodes]
        return [
            PacketRecord(
                entry.packet.stamp,
                entry.packet.delivered_at,
                self.settings.nodes[entry.packet.node].name,
                entry.packet.number,
                dict(zip(names[entry.packet.node], entry.packet.values, strict=True)),
                entry.packet.kind,  # type: ignore[arg-type] # as `_transmit` names it
                self._outcomes(entry),
            )
            for entry in self.entries[first:until]
        ]

    def _outcomes(self, entry: _SentPacket) -> dict[str, str]:
        node = entry.packet.node
        receivers = [*self._holding[node], *(one.component for one in self.listeners if node in one.nodes)]
        if entry.packet.kind == "lost":
            return {}
        if not entry.deliveries:
            return dict.fromkeys(receivers, "undelivered")
        return {name: what if isinstance(what, str) else what.outcome for name, what in entry.deliveries.items()}

    # -- state ------------------------------------------------------------------------------------------------------

    def save(self) -> Any:
        """What time changes here; the values of the plan are saved elsewhere."""
        return (
            list(self.mailbox.waiting),
            len(self.entries),
            (self.number, self._next, self._begun, self._sent.copy(), list(self._reads)),
            (list(self._newest), [set(numbers) for numbers in self._arrived]),
            [receiver.save() for receiver in self._receivers],
        )

    def restore(self, state: Any) -> None:
        """Return to what was saved.

        Args:
            state: as `save` gave it.
        """
        waiting, count, sending, (newest, arrived), receivers = state
        self.mailbox.waiting = list(waiting)
        del self.entries[count:]
        for packet in waiting:
            self.entries[packet.place].deliveries = {}
        self.number, self._next, self._begun, sent, reads = sending
        self._reads = list(reads)
        self._sent[:] = sent
        self._newest, self._arrived = list(newest), [set(numbers) for numbers in arrived]
        for receiver, saved in zip(self._receivers, receivers, strict=True):
            receiver.restore(saved)


def ages(records: Sequence[PacketRecord], settings: NetworkSettings, start: float, stop: float) -> dict[str, Any]:
    """How old what receivers hold is: mean and largest age of each node's values over a run.

    Args:
        records: of the run. settings: of the network. start, stop: of the run [s].

    Returns:
        By node ``mean_age`` and ``largest_age`` [s], from the exact instants of delivery.
    """
    found = {}
    for node in settings.nodes:
        own = [r for r in records if r.node == node.name and r.kind != "lost" and r.delivered_at <= stop]
        now, stamp, area, largest = start, start, 0.0, 0.0
        for record in sorted(own, key=lambda r: (r.delivered_at, r.stamp)):
            if record.stamp < stamp and settings.sequence == "checked":
                continue
            area += (record.delivered_at - now) * (0.5 * (record.delivered_at + now) - stamp)
            largest = max(largest, record.delivered_at - stamp)
            now, stamp = record.delivered_at, record.stamp
        area += (stop - now) * (0.5 * (stop + now) - stamp)
        found[node.name] = {"mean_age": area / (stop - start), "largest_age": max(largest, stop - stamp)}
    return found
