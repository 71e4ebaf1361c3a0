"""What a network refuses, in words; its chance; its presets."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from toys import scenario

from cosim.errors import CosimError
from cosim.network.chance import Chance
from cosim.network.settings import PRESETS, NetworkSettings, Node

NODES = {"front": ["source.sine", "source.cosine"], "rear": ["source.ramp_value"]}
SETTINGS = NetworkSettings((Node("a", ("x.y",)),), period=0.02)


@pytest.mark.parametrize(
    ("network", "words"),
    [
        ({"nodes": {}}, "needs at least one node"),
        ({"nodes": {"front": []}}, "node 'front' owns no signal"),
        ({"nodes": {"a": ["source.sine"], "b": ["source.sine"]}}, "owned by 'a' and 'b'"),
        ({"nodes": {"a": ["source.sine", "source.sine"]}}, "owned twice by 'a'"),
        ({"nodes": {"a": ["source.sine"]}}, "no node of the network owns source.ramp_value"),
        ({"nodes": {**NODES, "x": ["source.speed"]}}, "source: no variable 'speed'"),
        ({"period": 0.0}, "network.period: expected more than 0"),
        ({"period": None}, "either 'period'"),
        ({"period": 0.02, "cycle": 0.02}, "either 'period'"),
        ({"period": 1e-9}, "is too short"),
        ({"jitter": 0.05}, "jitter .0.05 s. must be shorter"),
        ({"protocol": "periodic"}, "'order' belongs to protocol 'periodic'"),
        ({"protocol": "periodic", "order": ["front", "front"]}, "node 'rear' never sends"),
        ({"protocol": "periodic", "order": ["front", "raer"]}, "no node 'raer'.*rear"),
        ({"protocol": "quadratic", "weights": {"front": [[1.0]]}}, "lacks the matrix of node 'rear'"),
        ({"protocol": "quadratic", "weights": {name: [[1.0]] for name in NODES}}, "must be 3 x 3"),
        ({"scales": {"source.sin": 1.0}}, "a signal without a node.*source.sine"),
        ({"preset": "mvb_17_ms"}, "unknown preset 'mvb_17_ms'.*mvb_16_ms"),
        ({"delay_model": "recorded"}, "needs 'delay_file'"),
        ({"receivers": ["listner"]}, "no component 'listner'.*listener"),
        ({"delay": 11.0}, "packets take 11 s at least, and listener can go back 10 s"),
        ({"perod": 1.0}, "network.perod: unknown key.*period"),
    ],
)
def test_what_cannot_be_is_reported_in_words(network: dict[str, Any], words: str) -> None:
    with pytest.raises(CosimError, match=words):
        scenario(**network).run()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("delay\n0.1\n-0.2\n", "line 3: delay -0.2 s; a packet does not arrive before it is sent"),
        ("late\n0.1\n", "no column 'delay'"),
        ("delay\nsoon\n", "line 2: 'soon' is no number"),
        ("delay\n", "holds no delays"),
    ],
)
def test_recorded_delays_that_cannot_be(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "delays.csv").write_text(text)
    with pytest.raises(CosimError, match=words):
        scenario(delay_model="recorded", delay_file=str(tmp_path / "delays.csv")).run()


def test_recorded_delays_are_used_in_turn(tmp_path: Path) -> None:
    (tmp_path / "delays.csv").write_text("delay\n0.01\n0.05\n0.2\n")
    outcome = scenario(stop=0.5, delay_model="recorded", delay_file=str(tmp_path / "delays.csv")).run()
    late = [p.delivered_at - p.stamp for p in outcome.result.packets[:4]]
    np.testing.assert_allclose(late, [0.01, 0.05, 0.2, 0.01], atol=1e-12)


def test_delays_are_distributed_as_they_say() -> None:
    uniform = Chance(replace(SETTINGS, delay_model="uniform", delay=0.1, delay_spread=0.2), 0.0)
    drawn = np.array([uniform.delay(k) for k in range(2000)])
    assert 0.1 <= drawn.min() < 0.101
    assert 0.299 < drawn.max() <= 0.3
    correlated = Chance(
        replace(SETTINGS, delay_model="correlated", delay=1.0, delay_spread=0.1, delay_correlation=0.9), 0.0
    )
    drawn = np.array([correlated.delay(k) for k in range(4000)])
    x = drawn - 1.0
    # 4000 draws of correlation 0.9 are worth some 210: their deviation is known to 5 %, their correlation to 0.01
    assert x.std() == pytest.approx(0.1, rel=0.15)
    assert float(np.mean(x[1:] * x[:-1]) / np.mean(x * x)) == pytest.approx(0.9, abs=0.03)
    assert correlated.delay(17) == Chance(correlated._settings, 0.0).delay(17)  # whatever was drawn before


def test_losses_come_in_bursts_where_that_is_asked_for() -> None:
    single = Chance(replace(SETTINGS, loss_fraction=0.2), 0.0)
    bursts = Chance(replace(SETTINGS, loss_fraction=0.2, loss_burst=5.0), 0.0)
    for chance, length, spread in ((single, 1.25, 0.15), (bursts, 5.0, 1.0)):
        lost = np.array([chance.lost(k) for k in range(4000)])
        assert lost.mean() == pytest.approx(0.2, abs=0.06)
        begins = np.sum(lost[1:] & ~lost[:-1]) + lost[0]
        assert lost.sum() / begins == pytest.approx(length, abs=spread)


def test_jitter_keeps_the_order_of_transmissions() -> None:
    chance = Chance(replace(SETTINGS, jitter=0.019, offset=0.5), 1.0)
    instants = np.array([chance.instant(k) for k in range(500)])
    assert np.all(np.diff(instants) > 0.0)
    assert np.all((instants - 1.5 - 0.02 * np.arange(500) >= 0.0) & (instants - 1.5 - 0.02 * np.arange(500) < 0.019))


@pytest.mark.parametrize("preset", PRESETS)
def test_presets_name_their_source_and_give_every_node_its_turn(preset: str) -> None:
    assert "IEC 61375" in str(PRESETS[preset]["source"])
    table = scenario(period=None, preset=preset).table()
    assert table.network is not None
    assert table.network.slot == pytest.approx(float(preset.split("_")[1]) * 1e-3 / 2)
