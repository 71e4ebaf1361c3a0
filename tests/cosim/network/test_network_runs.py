"""Measurements over a network: exact whatever the step, and what becomes of late, lost and doubled packets."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from toys import STOP, run, scenario

from cosim import Outcome, Scenario
from cosim.errors import CosimError
from cosim.results import stream as stream_module
from cosim.results.load_result import load_result
from cosim.results.record_rows import PACKET_ROWS

ROUGH: dict[str, Any] = {
    "delay_model": "uniform",
    "delay": 0.02,
    "delay_spread": 0.2,
    "loss_fraction": 0.2,
    "jitter": 0.03,
}


def of(outcome: Outcome, *names: str) -> np.ndarray:
    """Last values of signals."""
    return np.array([outcome[name][-1] for name in names])


SIGNALS = ("listener.estimate", "listener.first", "listener.second", "listener.passed_on", "network.source.sine")


@pytest.mark.parametrize("network", [{"delay": 0.05}, {}, ROUGH | {"duplicate_fraction": 0.3}])
def test_the_communication_step_does_not_matter(network: dict[str, Any]) -> None:
    runs = [run(step, stop=0.8, **network) for step in (0.001, 0.01, 0.1)]
    values = [of(outcome, *SIGNALS) for outcome in runs]
    # the ramp is integrated in parts of other lengths: rounding, of some 1000 additions
    np.testing.assert_allclose(values[1:], [values[0]] * 2, rtol=0.0, atol=1e-12)
    packets = [outcome.result.packets for outcome in runs]
    assert [(p.stamp, p.node, p.kind, p.outcomes) for p in packets[0]] == [
        (p.stamp, p.node, p.kind, p.outcomes) for p in packets[2]
    ]
    for packet in packets[2]:
        for name, value in packet.values.items():
            exact = {"sine": 3.0 * np.sin(2.0 * packet.stamp), "cosine": np.cos(2.0 * packet.stamp)}
            assert value == pytest.approx(exact.get(name.partition(".")[2], packet.stamp), abs=1e-12)


def test_an_observer_of_late_packets_does_not_see_the_communication_step() -> None:
    estimates = []
    for step in (0.005, 0.1):
        made = Scenario(stop=3.0, step=step, certificates="ignore")
        start = {"motor_angle": 1.0, "link_angle": 1.0}
        made.add("arm", model="flexible_joint_arm", parameters=start, **{"as": "block3"})
        settings: dict[str, Any] = {"options": {"model": "flexible_joint_arm"}, "parameters": {"delay": 0.15}}
        made.add("observer", observer="delayed_state_observer", late_policy="late", **{"as": "block3"}, **settings)
        made.connect(*(f"arm.{angle} -> observer.packet_{angle}" for angle in start))
        made.network(nodes={"motor": ["arm.motor_angle"], "link": ["arm.link_angle"]}, period=0.1, delay=0.15)
        outcome = made.run(warn=lambda _: None)
        estimates.append(of(outcome, "observer.link_angle", "observer.motor_angle"))
        assert abs(estimates[-1][0] - outcome["arm.link_angle"][-1]) < 0.1  # the drive is not told
    # RK4 with internal steps of 5 ms, in parts: fourth order, (5e-3 * 8.3)^4 / 120 a step
    np.testing.assert_allclose(estimates[1], estimates[0], rtol=0.0, atol=1e-6)


def test_packets_arrive_a_delay_later_and_are_replayed() -> None:
    outcome = run(0.1, delay=0.05)
    packets = outcome.result.packets
    assert [p.node for p in packets[:4]] == ["front", "rear", "front", "rear"]
    np.testing.assert_allclose([p.stamp for p in packets], 0.037 * np.arange(len(packets)), atol=1e-12)
    np.testing.assert_allclose([p.delivered_at - p.stamp for p in packets], 0.05, atol=1e-12)
    assert packets[0].outcomes == {"listener": "replayed"}
    assert packets[-1].outcomes == {"listener": "undelivered"}
    late = run(0.1, delay=0.05)
    # the ramp has the slope of the held speed: replayed at its stamp a packet changes nothing, now or late
    assert of(late, "listener.estimate")[0] == pytest.approx(STOP, abs=1e-9)
    counts = outcome.result.summary["network"]["packets"]
    assert counts["front"]["sent"] + counts["rear"]["sent"] == len(packets)
    # of each node every 0.074 s: age 0.05 s to 0.124 s from the first delivery on
    assert counts["rear"]["largest_age"] == pytest.approx(0.124, abs=1e-9)
    assert counts["rear"]["mean_age"] == pytest.approx(0.087, rel=0.05)  # before the first one it is less


def test_a_held_input_follows_at_the_instant_of_delivery() -> None:
    outcome = run(0.1, delay=0.05)
    time, held = outcome["time"], outcome["listener.passed_on"]
    packet = next(p for p in outcome.result.packets if p.node == "front" and p.stamp > 0.5)
    own = packet.values["source.cosine"]
    network = outcome["network.source.cosine"]
    at = np.flatnonzero(np.abs(time - packet.delivered_at) < 1e-9)
    assert len(at) == 2  # a row before and one after
    assert network[at[1]] == own != network[at[0]]
    assert held[at[1] + 1] == own
    assert outcome["network.stamp.front"][at[1]] == pytest.approx(packet.stamp, abs=1e-12)


def test_an_older_packet_does_not_replace_a_newer_one_unless_numbers_are_ignored() -> None:
    checked, ignored = (run(0.01, sequence=kind, **ROUGH) for kind in ("checked", "ignored"))
    assert checked.result.summary["network"]["packets"]["front"]["overtaken"] > 0
    stamps = [outcome["network.stamp.front"] for outcome in (checked, ignored)]
    assert np.all(np.diff(stamps[0]) >= 0.0)
    assert np.any(np.diff(stamps[1]) < 0.0)


def test_delays_are_made_equal_where_that_is_asked_for() -> None:
    network = ROUGH | {"loss_fraction": 0.0}
    outcome = run(0.01, equalise=0.22, **network)
    late = np.array([p.delivered_at - p.stamp for p in outcome.result.packets])
    np.testing.assert_allclose(late, 0.22, atol=1e-12)
    assert outcome.result.summary["network"]["packets"]["front"]["overtaken"] == 0
    half = run(0.01, equalise=0.1, **network)
    late = np.array([p.delivered_at - p.stamp for p in half.result.packets])
    usual = np.array([p.delivered_at - p.stamp for p in run(0.01, **network).result.packets])
    np.testing.assert_allclose(late, np.maximum(usual, 0.1), atol=1e-12)


def test_a_duplicate_is_reported_once_unless_numbers_are_ignored() -> None:
    checked, ignored = (run(0.01, sequence=kind, duplicate_fraction=1.0) for kind in ("checked", "ignored"))
    assert of(ignored, "listener.packets") == 2 * of(checked, "listener.packets")
    assert {p.outcomes["listener"] for p in checked.result.packets if p.kind == "duplicate"} == {"dropped"}


@pytest.mark.parametrize("together", [False, True])
def test_all_versions_of_fmi_are_notified_equally(tmp_path: Path, *, together: bool) -> None:
    network = ROUGH
    if together:  # two packets arrive at one instant
        (tmp_path / "delays.csv").write_text("delay\n0.047\n0.01\n")
        network = {"delay_model": "recorded", "delay_file": str(tmp_path / "delays.csv")}
    runs = [run(0.01, backend, **network) for backend in ("block3", "block2")]
    names = (*SIGNALS, "listener.packets")
    np.testing.assert_allclose(of(runs[1], *names), of(runs[0], *names), atol=1e-12)
    reported = [[p.outcomes for p in outcome.result.packets] for outcome in runs]
    assert reported[0] == reported[1]


def test_what_was_received_can_be_expected_and_reported() -> None:
    made = scenario(stop=0.5).expect("signal", signal="network.source.sine", max=3.0)
    made.expect("difference", signal="network.source.cosine", reference="source.cosine", max=0.2)
    assert [evaluated.passed for evaluated in made.run(warn=lambda _: None).expectations] == [True, True]
    with pytest.raises(CosimError, match=r"network: no variable 'source.sin'.*source.sine"):
        scenario(stop=0.5).expect("signal", signal="network.source.sin", max=3.0).run()


def test_seeds_and_names_decide_and_the_order_of_components_does_not() -> None:
    equal, other = run(seed=3, **ROUGH), run(seed=4, **ROUGH)
    assert [p.kind for p in equal.result.packets] != [p.kind for p in other.result.packets]
    turned = scenario(seed=3, **ROUGH)
    data = turned._data
    data["components"] = dict(reversed(data["components"].items()))
    data["connections"] = data["connections"][::-1]
    again = turned.run(warn=lambda _: None)
    assert again.result.packets == equal.result.packets
    np.testing.assert_array_equal(of(again, *SIGNALS), of(equal, *SIGNALS))


def test_the_order_of_nodes_changes_nothing_but_round_robin() -> None:
    nodes = {"rear": ["source.ramp_value"], "front": ["source.sine", "source.cosine"]}
    protocols: tuple[dict[str, Any], ...] = (
        {"protocol": "periodic", "order": ["front", "rear", "rear"]},
        {"protocol": "try-once-discard"},
    )
    for protocol in protocols:
        one, two = run(**protocol), run(**protocol, nodes=nodes)
        assert one.result.packets == two.result.packets
    assert run().result.packets != run(nodes=nodes).result.packets


def test_steps_that_are_done_again_send_equal_packets() -> None:
    halved = scenario(0.1, **ROUGH).master(control="doubling", tolerance=1e-3).run(warn=lambda _: None)
    once = run(0.1, **ROUGH)
    assert [(p.stamp, p.delivered_at, p.kind) for p in halved.result.packets] == [
        (p.stamp, p.delivered_at, p.kind) for p in once.result.packets
    ]
    np.testing.assert_allclose(of(halved, *SIGNALS), of(once, *SIGNALS), atol=1e-12)


@pytest.mark.parametrize("master", [{"algorithm": "jacobi"}, {"inputs": "interpolate"}, {"events": "local"}])
def test_every_master_gives_equal_rows(master: dict[str, str]) -> None:
    other = scenario(0.02, stop=0.5, **ROUGH).master(**master).run(warn=lambda _: None)
    usual = run(0.02, stop=0.5, **ROUGH)
    np.testing.assert_allclose(of(other, *SIGNALS), of(usual, *SIGNALS), atol=1e-12)
    assert [repr(p) for p in other.result.packets] == [repr(p) for p in usual.result.packets]


def test_a_source_with_steps_of_its_own_is_reported() -> None:
    slow = scenario(0.02, stop=0.5)
    slow._data["components"]["source"]["every"] = 5
    said: list[str] = []
    outcome = slow.run(warn=said.append)
    assert any("source takes whole steps: packets sent between two of its points" in text for text in said)
    late = [p.stamp - p.values["source.ramp_value"] for p in outcome.result.packets if p.node == "rear"]
    assert 0.0 <= min(late) <= max(late) <= 0.1  # at most a step of its own old


@pytest.mark.parametrize("protocol", ["round-robin", "try-once-discard"])
@pytest.mark.parametrize("delay", [0, 3])
def test_the_block_gives_the_numbers_of_the_service(protocol: str, delay: int) -> None:
    made = scenario(0.01, period=0.04, protocol=protocol, delay=0.04 * delay, loss_fraction=0.3, seed=7)
    made.add(
        "block",
        model="network_protocol",
        options={"signals": 3, "nodes": 2, "protocol": protocol, "delay_periods": delay},
        parameters={"period": 0.04, "loss_fraction": 0.3, "seed": 7.0, "node_of": [1.0, 1.0, 2.0]},
        **{"as": "block3"},
    )
    made.connect(*(f"source.{name} -> block.signal[{i}]" for i, name in enumerate(("sine", "cosine", "ramp_value"), 1)))
    outcome = made.network(receivers=["listener"]).run(warn=lambda _: None)
    grid = np.flatnonzero(np.diff(outcome["time"], append=np.inf) > 1e-9)  # rows after events
    for place, name in enumerate(("sine", "cosine", "ramp_value"), 1):
        for ours, theirs in ((f"network.source.{name}", "received"), (f"network.error.source.{name}", "error")):
            np.testing.assert_allclose(outcome[f"block.{theirs}[{place}]"][grid], outcome[ours][grid], atol=1e-12)
    np.testing.assert_array_equal(outcome["block.sender"][grid], outcome["network.sender"][grid])
    np.testing.assert_allclose(outcome["block.stamp[2]"][grid], outcome["network.stamp.rear"][grid], atol=1e-12)
    assert 0.15 < np.mean([p.kind == "lost" for p in outcome.result.packets]) < 0.5


def test_packets_are_kept_to_the_last_bit(tmp_path: object) -> None:
    packets = run(**ROUGH).result.packets
    path = f"{tmp_path}/packets.csv"
    PACKET_ROWS.write(path, packets)
    again = PACKET_ROWS.read(path)
    assert [repr(p) for p in again] == [repr(p) for p in packets]  # nan is nan


def test_what_was_sent_outlives_a_run_that_dies(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the folder are the packets until the first that was still on its way, and none of a former run."""
    monkeypatch.setattr(stream_module, "SECONDS", 0.0)
    whole = run(0.01, **ROUGH).result.packets
    (tmp_path / "packets.csv").write_text("of a former run")

    def die(t: float, _stop: float) -> None:
        if t > 1.0:
            raise RuntimeError("the program dies")

    with pytest.raises(RuntimeError, match="dies"):
        scenario(0.01, **ROUGH).run(warn=lambda _: None, stream=tmp_path, progress=die)
    found = load_result(tmp_path)
    count = len(found.packets)
    assert 1.0 <= found.time[-1] < STOP  # progress is told now and then
    assert [repr(p) for p in found.packets] == [repr(p) for p in whole[:count]]
    assert whole[count].delivered_at > found.time[-1]
    assert any(p.kind == "lost" for p in found.packets)
    ended = scenario(0.01, **ROUGH).run(warn=lambda _: None, stream=tmp_path)
    assert [repr(p) for p in load_result(tmp_path).packets] == [repr(p) for p in ended.result.packets]


def test_doubling_packets_loses_no_other_ones() -> None:
    """Loss depends on the seed and the number of the transmission, not on how many packets came before."""
    once, twice = (run(0.1, duplicate_fraction=fraction, **ROUGH).result.packets for fraction in (0.0, 0.7))
    assert any(p.kind == "duplicate" for p in twice)
    rest = [[(p.number, p.kind, p.stamp) for p in side if p.kind != "duplicate"] for side in (once, twice)]
    assert rest[0] == rest[1]


def test_a_component_may_have_a_line_beside_a_network(tmp_path: Path) -> None:
    """The source of a value that the network delivers is no component; its course is held."""
    (tmp_path / "log.csv").write_text("time,effort\n0,0\n5,1000\n", encoding="utf-8")
    run = Scenario(folder=tmp_path, stop=1.0, step=0.05, certificates="ignore")
    run.add("log", recording="log.csv", interpolation="linear")
    run.add("train", model="longitudinal_train").add("odometer", model="odometer")
    run.add("observer", observer="quasi_lpv_uio")
    run.connect("log.effort -> train.effort, observer.effort", "train.speed -> odometer.wheel_speed")
    run.connect("odometer.reading -> observer.odometer")
    run.network(nodes={"n": ["odometer.reading"]}, period=0.1)
    outcome = run.run(warn=lambda _text: None)
    assert len(outcome.result.packets) == 11  # at 0, 0.1 ... 1 s
    assert outcome["train.speed"][-1] > 0.0
