"""A stop with four jams of 200 ms: speed, effort, disturbance and residual, as in Figures 3-7 to 3-17."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet
from shared.shipped import run

ONSETS = (1.0, 1.6, 3.0, 4.0)
RELEASE = (
    "detected after 2 to 3 ms and freed 0.146 s after that, which is nominal: the release time is not printed, only "
    "that jams of 200 ms become 150 ms with a detection after 4 ms; edges are known at communication points of 1 ms"
)
FIGURE = "the thesis has it in a figure only, which was not available as data"


def main() -> None:
    """How long the brake is lost, the plans, and the curves."""
    sheet = Sheet(
        __file__, "A stop with four jams of 200 ms", "Aguiar Cota 2019, 3.2.3.2, 3.2.3.3, Figures 3-8 to 3-17"
    )
    outcome = run("jam_stopping")
    t, fault = outcome["time"], outcome["observer.odometer_fault"]
    lost = outcome["train.speed"], outcome["wheels.effort_loss"]
    begins, ends = t[1:][np.diff(lost[1]) > 0.5], t[1:][np.diff(lost[1]) < -0.5]
    for onset, begin, end in zip(ONSETS, begins, ends, strict=True):
        sheet.add(f"jam at {onset:g} s: brake lost for", "s", 0.15, end - begin, RELEASE)
    plans = np.flatnonzero(np.diff(outcome["controller.plans"]) > 0.5) + 1
    for number, k in enumerate(plans, 2):
        sheet.add(f"plan {number}, u*", "N/kg", None, outcome["controller.planned_effort"][k], FIGURE)
    stop = t[np.flatnonzero(lost[0] <= 0.0)[0]]
    sheet.add("fault-tolerant: stands after", "s", None, stop, FIGURE)
    quiet = np.abs(outcome["observer.residual"][(t > 0.5) & (t < 1.0)]).max()
    sheet.add("largest residual before the first jam below 1e-4 m/s", "", None, "yes" if quiet < 1e-4 else "no", FIGURE)
    drag = outcome["observer.disturbance"] + 0.01 + 0.001 * outcome["train.speed"] ** 2
    known = (t > 0.5) & (t < 1.0)
    sheet.add(
        "error of the disturbance before the first jam below 0.01 m/s2",
        "",
        None,
        "yes" if np.abs(drag[known]).max() < 0.01 else "no",
        FIGURE,
    )
    figure, axes = plt.subplots(2, 2, figsize=(10, 6), sharex=True, layout="constrained")
    shown = t <= stop + 0.5
    axes[0, 0].plot(t[shown], outcome["train.position"][shown], label="fault-tolerant")
    axes[0, 0].plot(t[shown], outcome["classical_train.position"][shown], "--", label="classical")
    axes[0, 0].set(ylabel="position from the mark [m]")
    inset = axes[0, 0].inset_axes((0.5, 0.12, 0.45, 0.45))
    late = (t > 6.5) & shown
    inset.plot(t[late], outcome["train.position"][late])
    inset.plot(t[late], outcome["classical_train.position"][late], "--")
    inset.set_ylim(-0.2, 0.2)
    inset.grid(alpha=0.3)
    axes[0, 1].plot(t[shown], outcome["controller.effort"][shown], lw=0.8, label="fault-tolerant")
    axes[0, 1].plot(t[shown], outcome["classical.effort"][shown], "--", lw=0.8, label="classical")
    axes[0, 1].set(ylabel="effort [N/kg]", ylim=(-40, 2))
    axes[1, 0].plot(t[shown], outcome["observer.disturbance"][shown], lw=0.8, label="estimated")
    axes[1, 0].plot(t[shown], -0.01 - 0.001 * outcome["train.speed"][shown] ** 2, "--", lw=0.8, label="true, no jam")
    axes[1, 0].set(ylabel="disturbance [m/s2]", xlabel="time [s]")
    axes[1, 1].plot(t[shown], outcome["observer.residual"][shown] * 1e3, lw=0.8, label="residual [mm/s]")
    axes[1, 1].plot(t[shown], fault[shown] * 10.0, lw=0.8, label="10 x fault detected")
    axes[1, 1].set(xlabel="time [s]", ylim=(-25, 25))
    for axis in axes.flat:
        axis.grid(alpha=0.3)
        axis.legend(fontsize=8, loc="best")
    sheet.finish(figure)


if __name__ == "__main__":
    main()
