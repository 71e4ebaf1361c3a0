"""Protocols of a network: which node sends at a transmission, and what a receiver holds after it. Pure functions.

Nodes are counted from 0. Signals and nodes keep the order in which they are given. Knows NumPy only; what works on
values is traceable.

Source: Hann 2014, section 1.1.3 (Nesic and Teel; Donkers and others).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

BEYOND = 38.0
"""No double of a standard normal number by Box and Muller lies beyond it."""
_A = (
    -39.69683028665376,
    220.9460984245205,
    -275.9285104469687,
    138.3577518672690,
    -30.66479806614716,
    2.506628277459239,
)
_B = (-54.47609879822406, 161.5858368580409, -155.6989798598866, 66.80131188771972, -13.28068155288572, 1.0)
_C = (
    -7.784894002430293e-3,
    -0.3223964580411365,
    -2.400758277161838,
    -2.549732539343734,
    4.374664141464968,
    2.938163982698783,
)
_D = (7.784695709041462e-3, 0.3224671290700398, 2.445134137142996, 3.754408661907416, 1.0)
_TAIL = 0.02425
_LEAST = 1e-300


Array = Any


def selection(node_sizes: Sequence[int], node: int) -> np.ndarray:
    """The matrix Gamma_i that keeps the signals of one node, shape (p, p).

    Args:
        node_sizes: number of signals of each node; p is their sum. node: number i of the node, from 0.

    Returns:
        ``diag{g_1 I, ..., g_l I}`` with ``g_j = 1`` for j = i, else 0 (Hann 2014, after (1.8)).
    """
    return np.diag(np.repeat([1.0 if j == node else 0.0 for j in range(len(node_sizes))], node_sizes))


def received(gamma: Array, y: Array, held: Array) -> Array:
    """What a receiver holds after a transmission: ``Gamma y + (I - Gamma) yhat``, (1.10) and (2.3).

    Args:
        gamma: Gamma of the node that sent, shape (p, p). y: the measurement, shape (p,).
        held: what was held before, shape (p,).
    """
    return gamma @ y + (np.eye(len(gamma)) - gamma) @ held


def network_error(y: Array, held: Array) -> Array:
    """``e = yhat - y``, shape (p,). The sign is that of Nesic and Teel; (1.2) prints the other one, against (1.4).

    Args:
        y: the measurement, shape (p,). held: the most recent values of a receiver, shape (p,).
    """
    return held - y


def round_robin(nodes: int) -> tuple[int, ...]:
    """The periodic order in which every node sends once, (1.20).

    Args:
        nodes: their number l.
    """
    return tuple(range(nodes))


def periodic_sender(order: Sequence[int], k: int) -> int:
    """The node sigma_k of a periodic protocol, ``sigma_{k+N} = sigma_k``, (1.19) and (2.7).

    Args:
        order: nodes of one period, N of them. k: number of the transmission, from 0.
    """
    return order[k % len(order)]


def silent_nodes(order: Sequence[int], nodes: int) -> list[int]:
    """Nodes that a periodic order never lets send. (2.32) holds only where there is none, which is not printed.

    Args:
        order: nodes of one period. nodes: their number.
    """
    return sorted(set(range(nodes)) - set(order))


def try_once_discard(node_sizes: Sequence[int], scales: Sequence[float] | None = None) -> np.ndarray:
    """The matrices that make a quadratic protocol try-once-discard, ``P_i = -Gamma_i' Gamma_i``, shape (l, p, p).

    Args:
        node_sizes: number of signals of each node. scales: errors of the signals that count alike, shape (p,); None
            for ones.
    """
    sizes = np.ones(sum(node_sizes)) if scales is None else np.asarray(scales, dtype=float)
    weight = np.diag(1.0 / sizes**2)
    return np.stack([-selection(node_sizes, i) @ weight for i in range(len(node_sizes))])


def smallest(costs: Sequence[Array]) -> Array:
    """Number of the smallest entry, the first one of several; traceable.

    Args:
        costs: one for each node.
    """
    chosen, best = 0.0 * costs[0], costs[0]
    for i, cost in enumerate(costs[1:], start=1):
        less = cost < best
        chosen, best = np.where(less, float(i), chosen), np.where(less, cost, best)
    return chosen


def quadratic_sender(weights: Array, error: Array) -> int:
    """The node sigma_k of a quadratic protocol, ``argmin_i x' P_i x``, (1.18); of equal nodes the first.

    Args:
        weights: P_i of the nodes, shape (l, p, p). error: x, the network error, shape (p,).
    """
    return int(np.argmin(np.asarray(weights) @ error @ error))


def loss_threshold(fraction: Any) -> Any:
    """The number below which a share `fraction` of standard normal numbers lies.

    Args:
        fraction: 0 to 1 [1].

    Returns:
        The normal quantile, -38 for 0 and 38 for 1. By the rational approximation of P. J. Acklam: within 1.2e-9 of
        it, relatively.
    """
    tail = np.minimum(fraction, 1.0 - fraction)
    far = np.sqrt(-2.0 * np.log(np.maximum(np.minimum(tail, _TAIL), _LEAST)))
    outer = _polynomial(_C, far) / _polynomial(_D, far)
    q = np.maximum(tail, _TAIL) - 0.5
    inner = q * _polynomial(_A, q * q) / _polynomial(_B, q * q)
    lower = np.where(tail < _TAIL, outer, inner)
    inside = np.where(fraction < 0.5, lower, -lower)
    return np.where(fraction <= 0.0, -BEYOND, np.where(fraction >= 1.0, BEYOND, inside))


def _polynomial(coefficients: tuple[float, ...], x: Any) -> Any:
    """Highest power first."""
    value = coefficients[0]
    for coefficient in coefficients[1:]:
        value = value * x + coefficient
    return value
