"""Protocols of a network against Hann 2014, and the block that travels with an exported system."""

from __future__ import annotations

from statistics import NormalDist

import numpy as np
import pytest

from plant_models.hybrid.runtime import Runtime
from plant_models.hybrid.signal import scalar_names
from plant_models.railway.network.network_protocol import NetworkProtocol
from plant_models.railway.network.protocols import (
    loss_threshold,
    network_error,
    periodic_sender,
    quadratic_sender,
    received,
    round_robin,
    selection,
    silent_nodes,
    try_once_discard,
)

SIZES = (3, 2)


def test_example_1_1_of_hann() -> None:
    gammas = [selection(SIZES, i) for i in range(2)]
    np.testing.assert_array_equal(gammas[0], np.diag([1.0, 1.0, 1.0, 0.0, 0.0]))
    np.testing.assert_array_equal(gammas[1], np.diag([0.0, 0.0, 0.0, 1.0, 1.0]))
    senders = [periodic_sender(round_robin(2), k) for k in range(4)]
    assert senders == [0, 1, 0, 1]  # node 1 where k is even
    y = [np.arange(5.0) + 10.0 * k for k in range(2)]
    before = np.full(5, -1.0)
    first = received(gammas[senders[0]], y[0], before)
    np.testing.assert_array_equal(first, [0.0, 1.0, 2.0, -1.0, -1.0])  # [y_n1(t_k); yhat_n2(t_k-1)]
    second = received(gammas[senders[1]], y[1], first)
    np.testing.assert_array_equal(second, [0.0, 1.0, 2.0, 13.0, 14.0])  # [y_n1(t_k); y_n2(t_k+1)]
    np.testing.assert_array_equal(network_error(y[1], second), second - y[1])


@pytest.mark.parametrize("order", [(0, 1, 2), (0, 1, 0, 2), (2, 2, 1, 0)])
def test_errors_vanish_after_one_period_and_not_before(order: tuple[int, ...]) -> None:
    kept = [np.eye(6) - selection((1, 2, 3), periodic_sender(order, k)) for k in range(2 * len(order))]
    for begin in range(len(order)):
        product = np.linalg.multi_dot(kept[begin : begin + len(order)])
        assert not product.any()  # (2.32)
    assert np.linalg.norm(np.linalg.multi_dot([*kept[:2], np.eye(6)]), 2) == 1.0  # (2.31)
    assert silent_nodes(order, 3) == []
    assert silent_nodes((0, 2), 3) == [1]  # for which (2.32) does not hold


def test_try_once_discard_is_a_quadratic_protocol() -> None:
    draws = np.random.default_rng(1).normal(size=(200, 5))
    weights = try_once_discard(SIZES)
    for e in draws:
        largest = int(np.argmax([np.linalg.norm(e[:3]), np.linalg.norm(e[3:])]))
        assert quadratic_sender(weights, e) == largest
    assert quadratic_sender(weights, np.zeros(5)) == 0  # of equal nodes the first
    scaled = try_once_discard((1, 1), (10.0, 1.0))
    assert quadratic_sender(scaled, np.array([5.0, 1.0])) == 1


def test_share_of_lost_packets_is_a_normal_quantile() -> None:
    shares = np.array([1e-9, 1e-3, 0.02425, 0.03, 0.2, 0.5, 0.8, 0.999])
    exact = [NormalDist().inv_cdf(share) for share in shares]
    np.testing.assert_allclose(loss_threshold(shares), exact, rtol=1.2e-9, atol=1e-12)  # as Acklam states
    assert (loss_threshold(0.0), loss_threshold(1.0)) == (-38.0, 38.0)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"signals": 0}, "signals must be 1 to 32, got 0"),
        ({"nodes": 1.5}, "nodes must be a whole number"),
        ({"protocol": "token"}, "unknown protocol 'token'"),
        ({"delay_periods": 65}, "delay_periods must be 0 to 64"),
    ],
)
def test_what_the_block_refuses(options: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        NetworkProtocol(**options)  # type: ignore[arg-type]


def test_a_node_that_never_sends_stops_the_block() -> None:
    block = NetworkProtocol(protocol="periodic", turns=3)
    runtime = Runtime(block)
    runtime.p[scalar_names(block.parameter_signals).index("order[2]")] = 1.0
    with pytest.raises(ValueError, match="node 2 never sends"):
        runtime.start(0.0)
