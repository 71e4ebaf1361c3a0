"""The train observers with the 10 Hz odometer of (3.50), on both profiles."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet
from shared.shipped import run
from train_profile import OBSERVERS, add_largest_errors

REPEATS = dict.fromkeys(OBSERVERS, 0.02) | {"differentiator_cdo": 0.1}  # S1 chatters, and its largest value with it
SCENARIOS = {"D": "freight_profile_d_10_hz", "B": "freight_profile_b_10_hz"}


def main() -> None:
    """Largest speed errors in both zones, and the errors over time."""
    sheet = Sheet(
        __file__,
        "Train on profiles D and B, odometer at 10 Hz",
        "Bouchama 2024, (3.50), section 3.5, Figures 3.18-3.23",
    )
    figure, axes = plt.subplots(2, 1, figsize=(8, 6), sharex=True, layout="constrained")
    for axis, (profile, scenario) in zip(axes, SCENARIOS.items(), strict=True):
        outcome = run(scenario)
        add_largest_errors(sheet, outcome, f"profile {profile}, ", REPEATS)
        t, true = outcome["time"], outcome["locomotive.speed"]
        for name, (label, _) in OBSERVERS.items():
            error = np.abs(outcome[f"{name}.speed"] - true)
            axis.semilogy(t[::4], error[::4] + 1e-5, lw=0.7, label=label)
        axis.set(ylabel=f"speed error [m/s], profile {profile}")
        axis.grid(alpha=0.3)
    axes[0].legend(fontsize=8)
    axes[1].set_xlabel("time [s]")
    sheet.finish(figure)


if __name__ == "__main__":
    main()
