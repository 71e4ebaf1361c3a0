"""Which node sends: Example 1.1, the products (2.31) and (2.32), and try-once-discard beside round-robin."""

from __future__ import annotations

from functools import reduce

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

from plant_models.railway.network.protocols import (
    network_error,
    periodic_sender,
    quadratic_sender,
    received,
    round_robin,
    selection,
    try_once_discard,
)

SIZES = (3, 2)
OURS = "the thesis describes try-once-discard in words and simulates none; signals are ours: 3 sin 2t and sin 0.4t"
PERIOD, STOP = 0.05, 20.0


def text(values: np.ndarray) -> str:
    """Numbers as a text."""
    return " ".join(f"{value:g}" for value in values)


def errors(protocol: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, network errors after each transmission, shape (k, 2), and who sent, of two signals on two nodes."""
    times = np.arange(0.0, STOP, PERIOD)
    y = np.stack([3.0 * np.sin(2.0 * times), np.sin(0.4 * times)], axis=1)
    held, weights, found, senders = y[0], try_once_discard((1, 1)), [], []
    for k, measured in enumerate(y):
        discards = protocol == "try-once-discard"
        node = quadratic_sender(weights, network_error(measured, held)) if discards else periodic_sender((0, 1), k)
        held = received(selection((1, 1), node), measured, held)
        found.append(network_error(measured, held))
        senders.append(node)
    return times, np.array(found), np.array(senders)


def main() -> None:
    """The printed example, then two protocols on the same signals."""
    sheet = Sheet(__file__, "Protocols of a network", "Hann 2014, Example 1.1, (1.5) to (1.20), (2.31), (2.32)")
    gammas = [selection(SIZES, i) for i in range(2)]
    sheet.add("diagonal of Gamma_1", "", "1 1 1 0 0", text(gammas[0].diagonal()))
    sheet.add("diagonal of Gamma_2", "", "0 0 0 1 1", text(gammas[1].diagonal()))
    turns = [periodic_sender(round_robin(2), k) + 1 for k in range(4)]
    sheet.add("sigma_k, k = 0 ... 3", "", "1 2 1 2", text(np.array(turns)))
    held = np.full(5, -1.0)  # of a transmission before
    for k, printed in enumerate(("0 1 2 -1 -1", "0 1 2 13 14")):
        held = received(gammas[turns[k] - 1], np.arange(5.0) + 10.0 * k, held)
        sheet.add(f"yhat(t_k+{k}) for y_i(t_k+j) = i - 1 + 10 j, yhat before -1", "", printed, text(held))
    kept = [np.eye(5) - gamma for gamma in gammas]
    sheet.add("(2.31): norm of the product over N - 1 transmissions", "1", 1.0, float(np.linalg.norm(kept[0], 2)))
    whole = float(np.linalg.norm(reduce(np.matmul, kept), 2))
    sheet.add("(2.32): norm of the product over N transmissions", "1", 0.0, whole)
    figure, axes = plt.subplots(1, 2, figsize=(11, 3.6), layout="constrained", sharey=True)
    for axis, protocol in zip(axes, ("round-robin", "try-once-discard"), strict=True):
        times, found, senders = errors(protocol)
        rms = float(np.sqrt(np.mean(found**2)))
        sheet.add(f"network error rms, {protocol}, a transmission every 0.05 s", "1", None, rms, OURS)
        sheet.add(f"share of the quick signal, {protocol}", "1", None, float(np.mean(senders == 0)), OURS)
        axis.plot(times, found, label=["3 sin 2t", "sin 0.4t"], drawstyle="steps-post", lw=0.9)
        axis.set(title=protocol, xlabel="time [s]", ylabel="network error after a transmission")
    sheet.finish(figure, *axes)


if __name__ == "__main__":
    main()
