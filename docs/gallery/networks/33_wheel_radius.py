"""A wheel radius that is 1 % wrong, found from the balise groups of Amsterdam - Utrecht in 1000 runs."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet
from shared.wheel_runs import learn_wheel_radius

MEMBERS, GROUPS, TRUE = 1000, 12, 0.01
NORMAL = 1.96  # standard deviations that hold 95 %
MODEL = (
    "ours: places of balises 0.5 m, readings 0.05 m/s, normal and independent; 95 % within two standard errors of 0.7 %"
)


def main() -> None:
    """Estimates, bands and how often these hold the truth."""
    sheet = Sheet(__file__, "Wheel radius learnt on the way", "Hann 2014, (4.7); the train case is ours")
    run = learn_wheel_radius(MEMBERS, GROUPS, TRUE)
    error = run.error - TRUE
    for group in (4, 6, 8, 10, 12):
        at = group - 1
        inside = float(np.mean(np.abs(error[:, at]) <= NORMAL * run.deviation[:, at]))
        sheet.add(f"band holds the truth after {group} groups", "%", None, 100.0 * inside, MODEL)
        band = f"{100.0 * NORMAL * run.deviation[:, at].mean():.3f}"
        sheet.add(f"half of the band after {group} groups", "%", None, band, MODEL)
    clear = float(np.mean(run.error[:, 9] > NORMAL * run.deviation[:, 9]))
    sheet.add("runs whose band after 10 groups excludes an error of 0", "%", None, 100.0 * clear, MODEL)
    sheet.add("mean error of the estimate after 10 groups", "%", None, f"{100.0 * error[:, 9].mean():.4f}", MODEL)
    figure, axis = plt.subplots(figsize=(6, 3.5), layout="constrained")
    for member in range(3):
        axis.errorbar(
            np.arange(1, GROUPS + 1) + 0.15 * member,
            100.0 * run.error[member],
            100.0 * NORMAL * run.deviation[member],
            fmt="o",
            markersize=3,
            label=f"run {member + 1}",
        )
    axis.axhline(100.0 * TRUE, color="k", linestyle=":")
    axis.set(xlabel="balise groups", ylabel="error of the wheel radius [%]", ylim=(0.0, 2.0))
    axis.legend(fontsize=8)
    sheet.finish(figure)


if __name__ == "__main__":
    main()
