"""How long a receiver may wait for a packet, as far as the settings of a network show before the run."""

from __future__ import annotations

from collections.abc import Collection

from cosim.network.settings import NetworkSettings

BY_ERROR = ("try-once-discard", "quadratic")


def longest_interval(settings: NetworkSettings, nodes: Collection[int]) -> tuple[float | None, str]:
    """The longest time between the stamps of two packets of some nodes, the start of the run counting as one.

    Args:
        settings: of the network. nodes: numbers of the nodes that count, from 0.

    Returns:
        The time [s], None where the settings do not bound it; and why, in words.
    """
    if settings.loss_fraction > 0.0:
        share = f"{100.0 * settings.loss_fraction:g} % of the packets are lost by chance"
        return None, f"{share}, any number of them in a row, so a gap may be of any length"
    everybody = len(set(nodes)) == len(settings.nodes)
    if settings.protocol in BY_ERROR and not everybody:
        return None, f"protocol '{settings.protocol}' picks nodes by their errors, so one may be silent for any length"
    order = settings.order or tuple(range(len(settings.nodes)))
    own = [place for place, node in enumerate(order) if everybody or node in nodes]
    waits = [later - place for place, later in zip(own, [*own[1:], own[0] + len(order)], strict=True)]
    first = settings.offset + own[0] * settings.period
    late = f", up to {settings.jitter:g} s late" if settings.jitter > 0.0 else ""
    turn = "each of its packets" if max(waits) == 1 else f"one in {max(waits)} of the network's packets"
    reason = f"{turn}, {settings.period:g} s from packet to packet{late}"
    return max(max(waits) * settings.period, first) + settings.jitter, reason


def sends_in_turn(settings: NetworkSettings, turns: Collection[int]) -> bool:
    """Whether some nodes send one after the other in a given order, and again from the first.

    Args:
        settings: of the network. turns: numbers of the nodes in their order, from 0.
    """
    wanted = list(turns)
    if settings.protocol in BY_ERROR:
        return len(wanted) < 2 and len(settings.nodes) == len(wanted)
    own = [node for node in settings.order or range(len(settings.nodes)) if node in wanted]
    starts = [i for i, node in enumerate(own) if node == wanted[0]]
    return any(own[i:] + own[:i] == wanted * (len(own) // len(wanted)) for i in starts)
