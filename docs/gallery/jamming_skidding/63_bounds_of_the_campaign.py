"""Table 5.9 in form: mean bounds over the samples that the campaign does not use, by length of the jam; synthetic."""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "studies"))
from validation_campaign_runs import CLASSES, JAM_CASES, PERIOD, TABLE_5_9, bounds, bounds_by_class, runs, unused

SEEDS = range(4)
NAMES = ("DMO", "CDO", "i-DMO")
FREE = (
    "published are means on confidential data that contain an error at each sample, of a size not printed; ours have "
    "none and stand just before the next sample"
)
JAMS = (
    "synthetic jams, and a detection that believes the odometer after two samples: the time without a reading is "
    "longer for the same jam, and decides; the range of the reading, for DMO and CDO 1.7 m/s2 times that time, "
    "is not printed"
)
TIMES = "the time between the samples used before and after the jam; not printed"


def main() -> None:
    """Means by class, and the bounds over the gap."""
    sheet = Sheet(__file__, "Bounds over unused samples of the campaign", "Aguiar Cota 2019, 5.4, Table 5.9")
    table = bounds_by_class(pair for run in runs(JAM_CASES, SEEDS) for pair in unused(run))
    for kind, (_, gap, means) in table.items():
        published = TABLE_5_9.get(kind, (None,) * 3)
        if kind in CLASSES:
            sheet.add(f"{kind}: mean time without a reading", "s", None, gap, TIMES)
        for name, old, new in zip(NAMES, published, means, strict=True):
            sheet.add(f"{kind}: mean {name}", "m/s", old, new, JAMS if kind in CLASSES else FREE)
    figure, axis = plt.subplots(figsize=(6, 4), layout="constrained")
    gaps = np.linspace(PERIOD, 3.0, 100)
    curves = np.array([bounds(gap) for gap in gaps])
    for name, curve in zip(NAMES, curves.T, strict=True):
        axis.semilogy(gaps, curve, label=name)
    axis.set_prop_cycle(None)
    for k in range(len(NAMES)):
        axis.plot([table[kind][1] for kind in TABLE_5_9], [means[k] for means in TABLE_5_9.values()], "x")
    axis.set(xlabel="time without a reading [s]", ylabel="bound of the speed error [m/s]")
    axis.set_title("x: published, at the mean time of our class", fontsize=9)
    sheet.finish(figure, axis, fontsize=8.5)


if __name__ == "__main__":
    main()
