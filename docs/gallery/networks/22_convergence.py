"""How fast held innovations find the state without noise, and how quiet they are with it: Figures 3.1 to 3.3."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from held import DECAYS, Run, pair
from shared.sheet import Sheet

SMALL = 0.05
FIGURE = "the figure prints no numbers"
FASTEST = "the figure shows that the constant gain converges first; its data are not available"


def settled(times: np.ndarray, found: np.ndarray, below: float = SMALL) -> float:
    """Time [s] after which both errors stay small."""
    large = np.abs(found).max(axis=1) >= below
    return float(times[np.flatnonzero(large)[-1]]) if large.any() else 0.0


def main() -> None:
    """A long period, four decays at 0.15 s, and noise."""
    sheet = Sheet(__file__, "Convergence of held innovations", "Hann 2014, Figures 3.1 to 3.3")
    figure, axes = plt.subplots(1, 3, figsize=(13, 4), layout="constrained")
    times, found = Run(pair("repaired", "a = 0.5")).errors(0.7, 20.0, hold=0.01)
    axes[0].plot(times, found, label=["error of x1", "error of x2"])
    axes[0].set_title("a = 0.5, samples every 0.7 s")
    sheet.add(
        "errors below 0.05 from, a = 0.5, every 0.7 s (Fig. 3.1)",
        "s",
        None,
        settled(times, found),
        "the figure prints no number; independently about 5 s, for both errors together",
        independent=5.0,
    )
    printed = Run(pair("printed", "a = 0.5"))
    sheet.add(
        "a = 0.5, every 0.7 s, printed gains",
        "",
        "works",
        "works" if printed.works(0.7) else "fails",
        "gains as printed",
    )
    for decay in DECAYS:
        times, found = Run(pair("repaired", decay)).errors(0.15, 8.0, hold=0.01)
        axes[1].semilogy(times, np.abs(found[:, 0]), label=decay)
        sheet.add(
            f"errors below 0.05 from, {decay}, every 0.15 s (Fig. 3.2)", "s", None, settled(times, found), FASTEST
        )
    axes[1].set_title("error of x1, samples every 0.15 s")
    spread = {}
    for decay in ("constant", "a = 0.5"):
        times, found = Run(pair("repaired", decay)).errors(0.15, 300.0, 0.1, hold=0.05)
        spread[decay] = found[times > 20.0, 0].std()
        axes[2].plot(times[times < 20.0], found[times < 20.0, 0], lw=0.8, label=decay)
    sheet.add(
        "noise of x1, constant over a = 0.5, every 0.15 s (Fig. 3.3)",
        "1",
        float(np.sqrt(0.23 / 0.06)),
        spread["constant"] / spread["a = 0.5"],
        "root of the variances of Table 3.2, printed to two digits; " + FIGURE,
        repeats=0.05,
    )
    axes[2].set_title("with noise of variance 0.1")
    for axis in axes:
        axis.set_xlabel("time [s]")
    sheet.finish(figure, *axes)


if __name__ == "__main__":
    main()
