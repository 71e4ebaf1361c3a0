"""What a network is: its nodes and protocol, when it sends, and what goes wrong on the way. Plain data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

Protocol = Literal["round-robin", "periodic", "try-once-discard", "quadratic"]
_DelayModel = Literal["constant", "uniform", "recorded", "correlated"]
_Sequences = Literal["checked", "ignored"]


@dataclass(frozen=True)
class Node:
    """A node.

    Args:
        name: of the node. signals: ``component.signal`` that it owns, in order.
    """

    name: str
    signals: tuple[str, ...]


@dataclass(frozen=True)
class NetworkSettings:
    """A network.

    Args:
        nodes: in the order of round-robin.
        protocol: which node sends.
        order: of ``periodic``: numbers of nodes, from 0.
        weights: of ``try-once-discard`` and ``quadratic``: P_i, shape (l, p, p); None for the others.
        period: time between two transmissions [s]. offset: of the first one, after the start [s].
        jitter: a transmission is up to so much later, uniform [s]; less than the period.
        delay_model: how long a packet takes. delay: constant part, or mean [s].
        delay_spread: width of ``uniform`` above `delay`; standard deviation of ``correlated`` [s].
        delay_correlation: of ``correlated``: from transmission to transmission, 0 to 1.
        delays: of ``recorded``: one after the other, and again from the first [s].
        equalise: a packet that is faster than this waits until so long after its measurement [s].
        loss_fraction: share of the packets that is lost.
        loss_burst: mean number of packets lost in a row; None where losses are independent.
        duplicate_fraction: share of the packets that arrives twice.
        sequence: whether receivers know a duplicate, and held inputs an older packet, by the number of the packet.
        seed: of all chance here.
    """

    nodes: tuple[Node, ...]
    protocol: Protocol = "round-robin"
    order: tuple[int, ...] = ()
    weights: np.ndarray | None = None
    period: float = 0.016
    offset: float = 0.0
    jitter: float = 0.0
    delay_model: _DelayModel = "constant"
    delay: float = 0.0
    delay_spread: float = 0.0
    delay_correlation: float = 0.0
    delays: Sequence[float] = ()
    equalise: float = 0.0
    loss_fraction: float = 0.0
    loss_burst: float | None = None
    duplicate_fraction: float = 0.0
    sequence: _Sequences = "checked"
    seed: int = 0

    @property
    def signals(self) -> tuple[str, ...]:
        """All signals, node by node."""
        return tuple(signal for node in self.nodes for signal in node.signals)

    @property
    def node_of(self) -> tuple[int, ...]:
        """Number of the node of each signal, from 0."""
        return tuple(i for i, node in enumerate(self.nodes) for _ in node.signals)

    @property
    def delay_range(self) -> tuple[float, float]:
        """Shortest and longest delay [s]; the latter is infinite where it has no bound."""
        shortest, longest = self.delay, self.delay
        if self.delay_model == "recorded":
            shortest, longest = min(self.delays), max(self.delays)
        elif self.delay_model == "uniform":
            longest += self.delay_spread
        elif self.delay_model == "correlated" and self.delay_spread > 0.0:
            shortest, longest = 0.0, float("inf")
        return max(shortest, self.equalise), max(longest, self.equalise)


# The bus of IEC 61375-3-1 polls process data in periods of powers of two. Makers name 16 ms to 512 ms as typical; no
# clause of the standard was checked.
_MVB = {
    f"mvb_{cycle}_ms": {"cycle": cycle * 1e-3, "delay": 1e-3, "source": "MVB (IEC 61375-3-1), typical; ours"}
    for cycle in (16, 32, 64, 128, 256, 512, 1024)
}
_TRDP = {
    "trdp_20_ms": {
        "cycle": 0.02,
        "delay_model": "uniform",
        "delay": 1e-3,
        "delay_spread": 9e-3,
        "source": "IEC 61375-2-3:2015, Table A.4: set by the user; a fifth of the default timeout of TCNopen; ours",
    },
    "trdp_50_ms": {
        "cycle": 0.05,
        "delay_model": "uniform",
        "delay": 1e-3,
        "delay_spread": 9e-3,
        "source": "IEC 61375-2-3:2015, Table A.4: set by the user; half of the default timeout of TCNopen; ours",
    },
}
PRESETS: Mapping[str, Mapping[str, object]] = {**_MVB, **_TRDP}
"""What trains carry, by name: keys of the network table, and the source of the numbers. `cycle` is the time in which
every node has its turn."""
