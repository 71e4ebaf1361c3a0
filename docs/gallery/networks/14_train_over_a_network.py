"""A train whose odometer and balises are two nodes: position and speed now from late measurements."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet
from shared.shipped import run

OURS = "ours: freight_delayed, balises every 20 m, profile D; rms over the hold phase, 25 s to 60 s"
DELAYS = (0.05, 0.15)
INTERVALS = (0.1, 0.5)
NAMES = ("predicted", "delayed", "held")


def errors(delay: float, interval: float) -> dict[str, tuple[float, float]]:
    """rms errors of position [m] and speed [m/s] by observer."""
    changes = {"network.period": interval, "network.delay": delay, "balises.latency": delay, "expect": []}
    changes |= {f"{name}.delay": delay for name in NAMES}
    outcome = run("freight_delayed", changes)
    hold = outcome["time"] > 25.0
    truth = {name: outcome[f"locomotive.{name}"][hold] for name in ("position", "speed")}
    return {
        name: tuple(
            float(np.sqrt(np.mean((outcome[f"{name}.{what}"][hold] - value) ** 2))) for what, value in truth.items()
        )  # type: ignore[misc]
        for name in NAMES
    }


def main() -> None:
    """Errors of the three observers over delay and interval."""
    sheet = Sheet(
        __file__, "A train behind a network: predicted, delayed, held", "ours, observers of Hann 2014, (2.16)"
    )
    figure, axis = plt.subplots(figsize=(7, 4.5), layout="constrained")
    places, labels = [], []
    for delay in DELAYS:
        for interval in INTERVALS:
            found = errors(delay, interval)
            for name in NAMES:
                where = f"{name}, delay {delay:g} s, packet every {interval:g} s"
                sheet.add(f"position, {where}", "m", None, found[name][0], OURS)
                sheet.add(f"speed, {where}", "m/s", None, found[name][1], OURS)
            labels.append(f"{delay:g} s late\nevery {interval:g} s")
            places.append([found[name][0] for name in NAMES])
    for k, name in enumerate(NAMES):
        axis.bar(np.arange(len(labels)) + 0.27 * (k - 1), [row[k] for row in places], 0.25, label=name)
    axis.set_xticks(range(len(labels)), labels)
    axis.set(yscale="log", ylabel="rms position error [m]")
    axis.legend()
    axis.grid(alpha=0.3)
    sheet.finish(figure)


if __name__ == "__main__":
    main()
