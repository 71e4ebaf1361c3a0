"""The network as a block: signals in, the values last received out. It travels with an exported system.

A system of its own; knows the hybrid foundation and the protocols.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal

import numpy as np

from plant_models.hybrid import HybridSystem, PeriodicEvent, input_signal, memory, output_signal, parameter, vector
from plant_models.hybrid.option import require_whole
from plant_models.hybrid.system import Array
from plant_models.railway.network.loss import loss_threshold
from plant_models.railway.network.protocols import (
    quadratic_costs,
    round_robin,
    silent_nodes,
    smallest,
    try_once_discard,
)

Protocol = Literal["round-robin", "periodic", "try-once-discard", "quadratic"]
MAX_DELAY = 64


class NetworkProtocol(HybridSystem):
    """One node of several sends at each transmission; a receiver holds what came last, a constant delay later.

    Transmissions are at ``start + offset + k * period``. At each of them the protocol chooses a node by its turn, or by
    the network error: what it sent last minus what it measures now. The packet arrives `delay_periods` periods later,
    if it is not lost. Until something was received the outputs are 0; the first transmission tells all nodes' values
    at once, as if the network had run before.

    The same numbers as the network of a scenario come out, lost packets included, where the seed is the same and the
    transmissions fall on communication points. Between two of them an input is what the master holds there: a scenario
    steps the sources to the instant, this block cannot.

    Args:
        node_sizes: number of signals of each node, in order.
        protocol: ``round-robin``; ``periodic``, in the order `order`; ``try-once-discard``, the node with the largest
            error; ``quadratic``, the node with the smallest ``e' P_i e``.
        order: of ``periodic``, numbers of the nodes from 1; each must occur.
        weights: of ``quadratic``, P_i row by row, shape (l, p, p).
        delay_periods: delay of every packet, in periods.

    Raises:
        ValueError: a node without signals, an unknown protocol, a node that never sends, weights of another shape, or
            a delay beyond `MAX_DELAY`.

    Source: Hann 2014, section 1.1.3 and (2.3) to (2.7); loss is ours.
    """

    name = "network_protocol"
    description = "Network: signals in, values last received out, one node at a time, delayed"
    source = "Hann 2014, section 1.1.3, (2.3) to (2.7); loss is ours"
    internal_step = 1e-2  # nothing flows
    parameters = (
        parameter("period", "s", 0.016, "Time between two transmissions", min=1e-6),
        parameter("offset", "s", 0.0, "Time of the first transmission after the start", min=0.0),
        parameter("loss_fraction", "1", 0.0, "Share of the packets that is lost", min=0.0, max=1.0),
    )
    events = (
        PeriodicEvent(
            "transmission",
            "period",
            "offset",
            (input_signal("loss_noise", "1", 0.0, "Standard normal number of the loss", variability="discrete"),),
            "A node sends, and what was sent a delay ago arrives",
        ),
    )
    option_choices: ClassVar[Mapping[str, Sequence[Any]]] = {
        "protocol": ("round-robin", "try-once-discard"),
        "delay_periods": range(5),
    }

    def __init__(
        self,
        *,
        node_sizes: Sequence[int] = (1, 1),
        protocol: Protocol = "round-robin",
        order: Sequence[int] = (),
        weights: Sequence[Sequence[Sequence[float]]] = (),
        delay_periods: int = 0,
    ) -> None:
        if not node_sizes:
            raise ValueError("network_protocol: node_sizes is empty; a network needs at least one node.")
        for number, size in enumerate(node_sizes, start=1):
            require_whole("network_protocol", **{f"node_sizes, entry {number},": size})
        require_whole("network_protocol", 0, MAX_DELAY, delay_periods=delay_periods)
        self.node_sizes, self.delay_periods = tuple(node_sizes), delay_periods
        count, nodes = sum(node_sizes), len(node_sizes)
        self.protocol = protocol
        self._order = _turns(protocol, order, nodes)
        self._weights = _weights(protocol, self.node_sizes, weights)
        self._node_of = [i for i, size in enumerate(self.node_sizes) for _ in range(size)]
        self.inputs = (input_signal("signal", "1", 0.0, "Measurements, node by node", size=count),)
        self.outputs = (
            output_signal("received", "1", "Values last received", variability="discrete", size=count),
            output_signal(
                "error",
                "1",
                "Last sent minus measured, before the last transmission",
                variability="discrete",
                size=count,
            ),
            output_signal("sender", "1", "Number of the node that sent last, from 1", variability="discrete"),
            output_signal(
                "stamp", "s", "When what was received of each node was measured", variability="discrete", size=nodes
            ),
        )
        self.states = (
            memory("held_value", "1", 0.0, "Values last received", size=count),
            memory("sent_value", "1", 0.0, "Values last sent", size=count),
            memory("last_error", "1", 0.0, "Network error before the last transmission", size=count),
            memory("held_stamp", "s", 0.0, "When they were measured", size=nodes),
            memory("last_sender", "1", 0.0, "Number of the node that sent last"),
            memory("turn", "1", 0.0, "Place in the order of the next one"),
            memory("begun", "1", 0.0, "1 after the first transmission"),
            *_packets(count, delay_periods),
        )
        super().__init__(
            node_sizes=tuple(node_sizes),
            protocol=protocol,
            order=tuple(order),
            weights=tuple(tuple(tuple(row) for row in weight) for weight in weights),
            delay_periods=delay_periods,
        )

    def jump(self, event: str, t: Array, x: Array, u: Any, p: Any) -> Array:
        """A node sends; what was sent a delay ago is received."""
        count, nodes = len(self._node_of), len(self.node_sizes)
        y = [u.signal[i] for i in range(count)]
        held, sent, _, stamps, (_, turn, begun), queue = self._parts(x)
        first = begun < 0.5
        held = [np.where(first, y[i], held[i]) for i in range(count)]
        sent = [np.where(first, y[i], sent[i]) for i in range(count)]
        stamps = [np.where(first, t, stamp) for stamp in stamps]
        error = [sent[i] - y[i] for i in range(count)]
        sender = self._sender(turn, error)
        sent = [np.where(sender == float(self._node_of[i]), y[i], sent[i]) for i in range(count)]
        lost = np.where(u.loss_noise < loss_threshold(p.loss_fraction), 1.0, 0.0)
        queue = [*queue, (y, sender + 1.0 - lost * (sender + 1.0), t + 0.0 * turn)]
        values, of, when = queue[0]
        held = [np.where(of == float(self._node_of[i] + 1), values[i], held[i]) for i in range(count)]
        stamps = [np.where(of == float(j + 1), when, stamps[j]) for j in range(nodes)]
        after = turn + 1.0
        after = np.where(after >= float(len(self._order)), 0.0, after)
        rest = queue[1:]
        return vector(
            *held,
            *sent,
            *error,
            *stamps,
            sender + 1.0,
            after,
            1.0,
            *(value for packet in rest for value in packet[0]),
            *(packet[1] for packet in rest),
            *(packet[2] for packet in rest),
        )

    def output(self, t: Array, x: Array, u: Any, p: Any) -> dict[str, Array]:
        """What is held, by whom it was sent and when it was measured."""
        held, _, error, stamps, (sender, _, _), _ = self._parts(x)
        return {"received": vector(*held), "error": vector(*error), "sender": sender, "stamp": vector(*stamps)}

    def _sender(self, turn: Array, error: list[Array]) -> Array:
        """Number of the node that sends, from 0."""
        if self.protocol in ("round-robin", "periodic"):
            sender = 0.0 * turn
            for place, node in enumerate(self._order):
                sender = np.where(turn == float(place), float(node), sender)
            return sender
        return smallest(quadratic_costs(list(self._weights), error))

    def _parts(self, x: Array) -> tuple[Any, ...]:
        """Held, sent, errors, stamps, (sender, turn, begun), and packets under way, the oldest first."""
        count, nodes, places = len(self._node_of), len(self.node_sizes), self.delay_periods
        cursor = 0

        def take(n: int) -> list[Array]:
            nonlocal cursor
            cursor += n
            return [x[i] for i in range(cursor - n, cursor)]

        held, sent, error, stamps, rest = take(count), take(count), take(count), take(nodes), take(3)
        values, senders, times = take(places * count), take(places), take(places)
        queue = [(values[i * count : (i + 1) * count], senders[i], times[i]) for i in range(places)]
        return held, sent, error, stamps, tuple(rest), queue


def _packets(count: int, places: int) -> tuple[Any, ...]:
    if places == 0:
        return ()
    return (
        memory("packet_value", "1", 0.0, "Measurements under way, the oldest first", size=places * count),
        memory("packet_sender", "1", 0.0, "Who sent them, from 1; 0 where the packet is lost", size=places),
        memory("packet_stamp", "s", 0.0, "When they were measured", size=places),
    )


def _turns(protocol: str, order: Sequence[int], nodes: int) -> tuple[int, ...]:
    """The periodic order from 0; one entry where the order is not periodic.

    Raises:
        ValueError: unknown protocol, a node that does not exist, or one that never sends.
    """
    if protocol == "round-robin":
        return round_robin(nodes)
    if protocol in ("try-once-discard", "quadratic"):
        return (0,)
    if protocol != "periodic":
        raise ValueError(
            f"Unknown protocol {protocol!r}; choose one of: round-robin, periodic, try-once-discard, quadratic."
        )
    for entry in order:
        require_whole("network_protocol", 1, nodes, **{"an entry of order": entry})
    silent = silent_nodes([entry - 1 for entry in order], nodes)
    if silent:
        raise ValueError(
            f"network_protocol: node {silent[0] + 1} never sends: it does not occur in order = {list(order)}."
        )
    return tuple(entry - 1 for entry in order)


def _weights(protocol: str, node_sizes: Sequence[int], weights: Any) -> np.ndarray:
    if protocol != "quadratic":
        return try_once_discard(node_sizes)
    given = np.asarray(weights, dtype=float)
    count = sum(node_sizes)
    if given.shape != (len(node_sizes), count, count):
        raise ValueError(
            f"network_protocol: weights must hold one matrix of {count} x {count} for each of {len(node_sizes)} nodes, "
            f"got shape {given.shape}."
        )
    return given
