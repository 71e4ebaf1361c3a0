"""Packets of a network compared as events."""

from __future__ import annotations

from cosim.comparison.event_comparison import Event, compare_events
from cosim.comparison.tolerance import Tolerance
from cosim.comparison.verdict import EventComparison
from cosim.results.result import PacketRecord, Result


def keeps_packets(result: Result) -> bool:
    """Whether a result would have packets if there had been any: a folder does, a single file or a baseline does not.

    Args:
        result: result or reference.
    """
    return bool(result.packets) or ("components" in result.summary and "events_recorded" not in result.summary)


def compare_packets(reference: Result, result: Result, tolerance: Tolerance, length: float) -> EventComparison:
    """Compare two lists of packets. Numbers say which belong together, and what is left the nearest stamp.

    Args:
        reference, result: whose packets. tolerance: of times and values. length: of the reference [s].
    """
    sides = (reference, result)
    if any(side.packets for side in sides) and not all(map(keeps_packets, sides)):
        return EventComparison(compared=False)
    ours, theirs = ([_event(packet) for packet in side.packets] for side in sides)
    return compare_events(ours, theirs, tolerance, length)


def _event(packet: PacketRecord) -> Event:
    return Event(
        packet,
        f"packet {packet.number} of {packet.node!r} ({packet.kind}) of {packet.stamp:.9g} s",
        {"node": packet.node, "number": str(packet.number), "kind": packet.kind},
        {"sent": packet.stamp, "delivered": packet.delivered_at},
        packet.values,
        packet.outcomes,
    )
