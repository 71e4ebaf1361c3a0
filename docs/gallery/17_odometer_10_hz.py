"""The train observers with the 10 Hz odometer of (3.50), on both profiles."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from sheet import Sheet
from train_profile import NO_DATA, OBSERVERS, ZONES

from cosim import Scenario

SCENARIOS = {"D": "freight_profile_d_10_hz", "B": "freight_profile_b_10_hz"}


def main() -> None:
    """Largest speed errors in both zones, and the errors over time."""
    sheet = Sheet(
        __file__, "Train on profiles D and B, odometer at 10 Hz", "Bouchama 2024, (3.50), section 3.5, Figures 3.18-3.23"
    )
    figure, axes = plt.subplots(2, 1, figsize=(8, 6), sharex=True, layout="constrained")
    for axis, (profile, scenario) in zip(axes, SCENARIOS.items(), strict=True):
        outcome = Scenario.load(scenario).run(warn=lambda _warning: None)
        if outcome.failure is not None:
            raise RuntimeError(outcome.failure)
        t, true = outcome["time"], outcome["locomotive.speed"]
        for name, (label, published) in OBSERVERS.items():
            error = np.abs(outcome[f"{name}.speed"] - true)
            for zone, (start, end) in ZONES.items():
                largest = float(error[(t >= start) & (t <= end)].max())
                # S1 chatters, and its largest value with it.
                words = f"profile {profile}, {label}: largest speed error, {zone}"
                sheet.add(
                    words, "m/s", published.get(zone), largest, NO_DATA, repeats=0.1 if name == "differentiator_cdo" else 0.02
                )
            axis.semilogy(t[::4], error[::4] + 1e-5, lw=0.7, label=label)
        axis.set(ylabel=f"speed error [m/s], profile {profile}")
        axis.grid(alpha=0.3)
    axes[0].legend(fontsize=8)
    axes[1].set_xlabel("time [s]")
    sheet.finish(figure)


if __name__ == "__main__":
    main()
