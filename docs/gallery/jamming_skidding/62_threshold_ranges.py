"""Tables 5.2 and 5.3 in form: missed jams and false detections over the threshold, on synthetic data."""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "studies"))
from validation_campaign import RANGES, THRESHOLDS, ends, threshold_shares

CASES, SEEDS = ("HS BaA", "LS BaA"), range(4)
CONFIDENTIAL = (
    "the measured runs are confidential; these are synthetic: the lower end is what else moves the residual (begin of "
    "the braking, held odometer), the upper one the depth of our jams"
)


def main() -> None:
    """Where half of the detections are false, and where 99 % of the jams are missed."""
    sheet = Sheet(__file__, "Range of the detection threshold", "Aguiar Cota 2019, Tables 5.2 and 5.3")
    missed, false = threshold_shares(CASES, SEEDS)
    figure, axes = plt.subplots(1, len(CASES), figsize=(8, 3.4), layout="constrained", sharey=True)
    for case, axis in zip(CASES, axes, strict=True):
        low, high = ends(missed[case], false[case], RANGES[case][2])
        ours = f"no more than {THRESHOLDS[0]:g}" if low is None else low
        sheet.add(f"{case}: half of the detections false", "m/s", RANGES[case][0], ours, CONFIDENTIAL)
        ours = f"more than {THRESHOLDS[-1]:g}" if high is None else high
        sheet.add(f"{case}: 99 % of the jams missed", "m/s", RANGES[case][1], ours, CONFIDENTIAL)
        axis.semilogx(THRESHOLDS, 100.0 * missed[case], "o-", label="missed")
        axis.semilogx(THRESHOLDS, 100.0 * np.nan_to_num(false[case]), "s--", label="false")
        axis.axvline(RANGES[case][2], color="k", linewidth=0.8)
        axis.set(title=case, xlabel="threshold [m/s]")
        axis.grid(alpha=0.3)
    axes[0].set(ylabel="share [%]")
    axes[0].legend()
    sheet.finish(figure)


if __name__ == "__main__":
    main()
