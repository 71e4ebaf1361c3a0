"""Packets compared as events."""

from __future__ import annotations

from dataclasses import replace
from math import nan

import pytest
from made_results import compared, made

from cosim.comparison.compare import _keeps_packets
from cosim.comparison.comparison import Comparison
from cosim.comparison.comparison_text import comparison_text
from cosim.provenance.rerun import _equal_result
from cosim.report.live.render import live_page
from cosim.report.page.comparison import comparison_page
from cosim.results.result import PacketRecord, Result

TIME = [0.0, 10.0]
PACKETS = [
    PacketRecord(1.0 + k, 1.1 + k, "front", k, {"train.speed": 10.0 * k}, "sent", {"observer": "held"})
    for k in range(5)
]
RUN: dict[str, object] = {"components": []}


def result(packets: list[PacketRecord], summary: dict[str, object] | None = None) -> Result:
    return replace(made(TIME, y=TIME, summary=RUN if summary is None else summary), packets=packets)


def verdict(*changed: PacketRecord) -> Comparison:
    """Of a run whose third packet is another."""
    return compared(result(PACKETS), result([*PACKETS[:2], *changed, *PACKETS[3:]]))


LOST = replace(PACKETS[2], kind="lost", delivered_at=nan, outcomes={})


@pytest.mark.parametrize(
    ("now", "kinds", "text"),
    [
        ([], ["missing"], "packet 2 of 'front' (sent) of 3 s is missing"),
        ([PACKETS[2], replace(PACKETS[2], kind="duplicate")], ["extra"], "(duplicate) of 3 s is only in the result"),
        ([replace(PACKETS[2], delivered_at=3.2)], ["time"], "delivered 0.1 s late (allowed 1e-06 s)"),
        ([replace(PACKETS[2], values={"train.speed": 20.1})], ["payload"], "train.speed 20.1 instead of 20 (allowed"),
        ([replace(PACKETS[2], outcomes={"observer": "dropped"})], ["payload"], "outcome at observer 'dropped'"),
        ([replace(PACKETS[2], node="rear")], ["payload"], "node 'rear' instead of 'front'"),
        ([LOST], ["time", "payload"], "delivered never"),
    ],
)
def test_a_packet_that_is_not_as_in_the_reference_is_reported(
    now: list[PacketRecord], kinds: list[str], text: str
) -> None:
    comparison = verdict(*now)
    assert [d.kind for d in comparison.packets.differences] == kinds
    assert not comparison.equal
    assert text in comparison.packets.differences[0].text
    assert comparison.packets.differences[0].text in comparison_text(comparison)
    assert comparison.to_dict()["packets"]["differences"][0]["kind"] == kinds[0]
    assert "Packets of the network" in live_page(comparison_page(comparison))


def test_equal_packets_agree_in_any_order_and_within_the_tolerance() -> None:
    near = replace(PACKETS[2], values={"train.speed": 20.0005}, delivered_at=3.1 + 5e-7)
    comparison = compared(result(PACKETS), result([near, *PACKETS[3:], *PACKETS[:2]]))
    assert comparison.equal
    assert "; 5 packets match." in comparison_text(comparison)
    assert not _equal_result(result(PACKETS), result([*PACKETS[:2], near, *PACKETS[3:]]))
    assert _equal_result(result([LOST]), result([replace(LOST)]))


def test_what_keeps_no_packets_is_not_compared() -> None:
    for table in (result([], {}), result([], {"components": [], "events_recorded": True})):
        comparison = compared(result(PACKETS), table)
        assert not comparison.packets.compared
        assert "packets not compared: one side keeps none" in comparison_text(comparison)
    assert len(compared(result(PACKETS), result([])).packets.differences) == 5
    assert "packets" not in comparison_text(compared(result([]), result([])))


def test_packets_in_memory_are_kept_whatever_the_summary_says() -> None:
    assert _keeps_packets(result(PACKETS, {}))
    assert not _keeps_packets(result([], {}))
