"""The network as a block: signals in, the values last received out. It travels with an exported system.

A system of its own; knows the hybrid foundation and the protocols.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from plant_models.hybrid import Array, HybridSystem, PeriodicEvent, vector
from plant_models.hybrid.noise import Purpose
from plant_models.hybrid.option import require_chosen, require_whole
from plant_models.hybrid.signal import Signal, discrete_output, input_signal, memory, parameter, standard_normal
from plant_models.railway.network.protocols import loss_threshold, smallest, try_once_discard

Protocol = Literal["round-robin", "periodic", "try-once-discard", "quadratic"]
PROTOCOLS = ("round-robin", "periodic", "try-once-discard", "quadratic")
MOST_SIGNALS, MOST_NODES, MOST_TURNS, LONGEST_DELAY = 32, 16, 64, 64


class NetworkProtocol(HybridSystem):
    """One node of several sends at each transmission; a receiver holds what came last, a constant delay later.

    Transmissions are at ``start + offset + k * period``. At each of them the protocol chooses a node by its turn, or by
    the network error: what it sent last minus what it measures now. The packet arrives `delay_periods` periods later,
    if it is not lost. Until something was received the outputs are 0; the first transmission shows all nodes' values
    at once, as if the network had run before.

    The same numbers as the network of a scenario come out, lost packets included, where the seed is the same and the
    transmissions fall on communication points. Between two of them an input is what the master holds there: a scenario
    steps the sources to the instant, this block cannot.

    Args:
        signals: number of signals. Whose they are is the parameter `node_of`.
        nodes: number of nodes.
        protocol: ``round-robin``; ``periodic``, in the order of the parameter `order`; ``try-once-discard``, the node
            with the largest error, each signal by its `error_scale`; ``quadratic``, the node with the smallest
            ``e' P_i e``, whose matrices are the parameter `weights`, node by node and row by row.
        turns: of ``periodic``: transmissions of one period.
        delay_periods: delay of every packet, in periods.

    Raises:
        ValueError: an unknown protocol, or a number that is not whole or out of its range.

    Source: Hann 2014, section 1.1.3 and (2.3) to (2.7); loss is ours.
    """

    name = "network_protocol"
    description = "Network: signals in, values last received out, one node at a time, delayed"
    source = "Hann 2014, section 1.1.3, (2.3) to (2.7); loss is ours"
    internal_step = 1e-2  # nothing flows
    bounded_parameters = "all"
    purpose = Purpose.NETWORK
    events = (
        PeriodicEvent(
            "transmission",
            "period",
            "offset",
            (standard_normal("loss_noise", "Standard normal number of the loss"),),
            "A node sends, and what was sent a delay ago arrives",
        ),
    )
    option_choices = {
        "signals": range(1, MOST_SIGNALS + 1),
        "nodes": range(1, MOST_NODES + 1),
        "protocol": PROTOCOLS,
        "turns": range(1, MOST_TURNS + 1),
        "delay_periods": range(LONGEST_DELAY + 1),
    }

    def __init__(
        self,
        *,
        signals: int = 2,
        nodes: int = 2,
        protocol: Protocol = "round-robin",
        turns: int = 2,
        delay_periods: int = 0,
    ) -> None:
        require_chosen(self.name, self.option_choices, protocol=protocol)
        require_whole("network_protocol", 1, MOST_SIGNALS, signals=signals)
        require_whole("network_protocol", 1, MOST_NODES, nodes=nodes)
        require_whole("network_protocol", 1, MOST_TURNS, turns=turns)
        require_whole("network_protocol", 0, LONGEST_DELAY, delay_periods=delay_periods)
        self.signals, self.nodes, self.protocol = signals, nodes, protocol
        self.turns = turns if protocol == "periodic" else nodes
        self.delay_periods = delay_periods
        self.parameters = (*_parameters(signals, nodes), *_protocol_parameters(protocol, signals, nodes, turns))
        self.inputs = (input_signal("signal", "1", 0.0, "Measurements", size=signals),)
        self.outputs = (
            _held_output("received", "1", "Values last received", signals),
            _held_output("error", "1", "Last sent minus measured, before the last transmission", signals),
            _held_output("sender", "1", "Number of the node that sent last, from 1", None),
            _held_output("stamp", "s", "When what was received of each node was measured", nodes),
        )
        self.states = (*_memory(signals, nodes), *_packets(signals, delay_periods))
        super().__init__(signals=signals, nodes=nodes, protocol=protocol, turns=turns, delay_periods=delay_periods)

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """A node sends; what was sent a delay ago is received."""
        y = [u.signal[i] for i in range(self.signals)]
        owner = [p.node_of[i] for i in range(self.signals)]
        first, turn = x.begun < 0.5, x.turn
        held = [np.where(first, y[i], x.held_value[i]) for i in range(self.signals)]
        sent = [np.where(first, y[i], x.sent_value[i]) for i in range(self.signals)]
        stamps = [np.where(first, t, stamp) for stamp in x.held_stamp]
        error = [sent[i] - y[i] for i in range(self.signals)]
        sender = self._sender(turn, error, p)
        sent = [np.where(sender == owner[i], y[i], sent[i]) for i in range(self.signals)]
        arrives = np.where(u.loss_noise < loss_threshold(p.loss_fraction), 0.0, sender)
        under_way = zip(x.packet_value, x.packet_sender, x.packet_stamp, strict=True) if self.delay_periods else ()
        queue = [*under_way, (y, arrives, t)]
        values, of, when = queue[0]
        held = [np.where(of == owner[i], values[i], held[i]) for i in range(self.signals)]
        stamps = [np.where(of == j + 1.0, when, stamps[j]) for j in range(self.nodes)]
        following = np.where(turn + 1.0 >= float(self.turns), 0.0, turn + 1.0)
        return {
            "held_value": vector(*held),
            "sent_value": vector(*sent),
            "last_error": vector(*error),
            "held_stamp": vector(*stamps),
            "last_sender": sender,
            "turn": following,
            "begun": 1.0,
            **self._packets_of(queue[1:]),
        }

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {"received": x.held_value, "error": x.last_error, "sender": x.last_sender, "stamp": x.held_stamp}

    def requirements(self, p: Any) -> dict[str, Array]:
        """Parameters keep their bounds; every signal has a node, and every node its turn."""
        needed = super().requirements(p)
        if self.protocol == "periodic":
            for node in range(1, self.nodes + 1):
                times = sum(np.where(p.order[i] == float(node), 1.0, 0.0) for i in range(self.turns))
                needed[f"node {node} never sends: it must occur in the parameter order"] = np.where(
                    times > 0.5, 1.0, 0.0
                )
        return needed

    def _sender(self, turn: Array, error: list[Array], p: Any) -> Array:
        """Number of the node that sends, from 1."""
        if self.protocol == "round-robin":
            return turn + 1.0
        if self.protocol == "periodic":
            sender = p.order[0] + 0.0 * turn
            for place in range(1, self.turns):
                sender = np.where(turn == float(place), p.order[place], sender)
            return sender
        if self.protocol == "try-once-discard":
            squares = [(error[i] / p.error_scale[i]) ** 2 for i in range(self.signals)]
            nodes = [float(j) for j in range(1, self.nodes + 1)]
            return smallest(
                [-sum(np.where(p.node_of[i] == j, s, 0.0 * s) for i, s in enumerate(squares)) for j in nodes]
            ) + (1.0)
        count = self.signals
        entries = [p.weights[i] for i in range(self.nodes * count * count)]
        rows = [entries[i : i + count] for i in range(0, len(entries), count)]
        return smallest(_quadratic_costs([rows[i : i + count] for i in range(0, len(rows), count)], error)) + 1.0

    def _packets_of(self, under_way: list[tuple[Any, Array, Array]]) -> dict[str, Array]:
        """Packets under way, the oldest first, as they are remembered."""
        if not under_way:
            return {}
        values, senders, stamps = zip(*under_way, strict=True)
        together = vector(*(value for packet in values for value in packet))
        shape = (self.delay_periods, self.signals, *together.shape[1:])
        return {
            "packet_value": np.reshape(together, shape),
            "packet_sender": vector(*senders),
            "packet_stamp": vector(*stamps),
        }


def spread(signals: int, nodes: int) -> list[int]:
    """Number of the node of each signal, from 1, where they are spread evenly, the first nodes having more.

    Args:
        signals: how many. nodes: how many.
    """
    return [i * min(nodes, signals) // signals + 1 for i in range(signals)]


def _parameters(signals: int, nodes: int) -> tuple[Any, ...]:
    owner = tuple(float(node) for node in spread(signals, nodes))
    return (
        parameter("period", "s", 0.016, "Time between two transmissions", min=1e-6),
        parameter("offset", "s", 0.0, "Time of the first transmission after the start", min=0.0),
        parameter("loss_fraction", "1", 0.0, "Share of the packets that is lost", min=0.0, max=1.0),
        parameter("node_of", "1", owner, "Number of the node of each signal, from 1", min=1.0, max=nodes, size=signals),
    )


def _protocol_parameters(protocol: str, signals: int, nodes: int, turns: int) -> tuple[Any, ...]:
    if protocol == "periodic":
        order = tuple(float(i % nodes + 1) for i in range(turns))
        return (parameter("order", "1", order, "Nodes in the order of their turns", min=1.0, max=nodes, size=turns),)
    if protocol == "try-once-discard":
        text = "Errors of the signals that count alike"
        return (parameter("error_scale", "1", (1.0,) * signals, text, min=1e-12, size=signals),)
    if protocol == "quadratic":
        owner = spread(signals, nodes)
        start = try_once_discard([owner.count(node) for node in range(1, nodes + 1)]).ravel()
        text = "Matrices P of the nodes, row by row; at first those of try-once-discard"
        return (parameter("weights", "1", tuple(start.tolist()), text, size=len(start)),)
    return ()


def _held_output(name: str, unit: str, text: str, size: int | None) -> Any:
    return discrete_output(name, unit, text, size=size)


def _memory(signals: int, nodes: int) -> tuple[Signal, ...]:
    """What was received and sent last, and whose turn it is."""
    return (
        memory("held_value", "1", 0.0, "Values last received", size=signals),
        memory("sent_value", "1", 0.0, "Values last sent", size=signals),
        memory("last_error", "1", 0.0, "Network error before the last transmission", size=signals),
        memory("held_stamp", "s", 0.0, "When they were measured", size=nodes),
        memory("last_sender", "1", 0.0, "Number of the node that sent last"),
        memory("turn", "1", 0.0, "Place in the order of the next one"),
        memory("begun", "1", 0.0, "1 after the first transmission"),
    )


def _packets(signals: int, places: int) -> tuple[Any, ...]:
    if places == 0:
        return ()
    return (
        memory("packet_value", "1", 0.0, "Measurements under way, the oldest first", shape=(places, signals)),
        memory("packet_sender", "1", 0.0, "Who sent them, from 1; 0 where the packet is lost", size=places),
        memory("packet_stamp", "s", 0.0, "When they were measured", size=places),
    )


def _quadratic_costs(weights: Sequence[Array], error: Array) -> list[Array]:
    """``x' P_i x`` of every node, (1.18)."""
    costs = []
    for weight in weights:
        cost = 0.0 * error[0]
        for row, left in zip(weight, error, strict=True):
            for entry, right in zip(row, error, strict=True):
                if not (isinstance(entry, float) and entry == 0.0):  # a plain zero; symbols are not examined
                    cost = cost + left * entry * right
        costs.append(cost)
    return costs
