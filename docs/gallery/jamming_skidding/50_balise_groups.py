"""The balise groups of Amsterdam - Utrecht: how far apart they lie, and what SUBSET-041 grants an odometer there."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

from cosim.balises.layout import from_csv
from cosim.evaluation.balise_gaps import FIXED_SHARE, SHARE_OF_DISTANCE
from cosim.scenario.shipped import SHIPPED

FILE = "amsterdam_utrecht_balise_groups.csv"
NOT_LINKED = 2  # groups before the first linked one
FULL_SPEED = 140.0 / 3.6  # [m/s]
THESIS_SPACING = 200.0  # [m]
OTHER = "the thesis lays its balises every 200 m"


def main() -> None:
    """Statistics of the gaps, and the share of the way that lies in gaps longer than a length."""
    sheet = Sheet(__file__, "Balise groups of a real line", "Aguiar Cota 2019, sections 3.3 and 5.2 (200 m); openETCS")
    places = from_csv(str(SHIPPED / FILE)).positions
    gaps = np.diff(places[NOT_LINKED:])
    sheet.add("groups", "1", None, len(places), independent=98)
    sheet.add("shortest gap", "m", None, gaps.min(), independent=50)
    for share, other in ((25, 66), (50, 229), (75, 493), (95, 788)):
        published, why = (THESIS_SPACING, OTHER) if share == 50 else (None, "")
        sheet.add(f"gaps, {share} % quantile", "m", published, np.percentile(gaps, share), why, independent=other)
    sheet.add("longest gap", "m", THESIS_SPACING, gaps.max(), OTHER, independent=874)
    sheet.add("mean gap", "m", THESIS_SPACING, gaps.mean(), OTHER, independent=313)
    falling = np.sort(gaps)[::-1]
    half = falling[np.searchsorted(np.cumsum(falling), gaps.sum() / 2.0)]
    sheet.add("half of the way lies in gaps of at least", "m", None, half, independent=501)
    sheet.add("time for these at 140 km/h", "s", None, half / FULL_SPEED, independent=12.9)
    sheet.add("time for the longest at 140 km/h", "s", None, gaps.max() / FULL_SPEED, independent=22.5)
    average = FIXED_SHARE + SHARE_OF_DISTANCE / 2.0 * np.sum(gaps**2) / gaps.sum()
    sheet.add("SUBSET-041, half-width averaged over the way", "m", None, average, independent=17.7)
    largest = FIXED_SHARE + SHARE_OF_DISTANCE * gaps.max()
    sheet.add("SUBSET-041 at the end of the longest gap", "m", None, largest, independent=48.7)
    figure, axis = plt.subplots(figsize=(6, 4), layout="constrained")
    lengths = np.concatenate(([0.0], np.sort(gaps)))
    axis.step(lengths, 100.0 * (1.0 - np.cumsum(lengths) / gaps.sum()), where="post", label="of the way")
    axis.step(lengths, 100.0 * (1.0 - np.arange(len(lengths)) / len(gaps)), where="post", label="of the gaps")
    axis.axvline(THESIS_SPACING, color="k", linewidth=0.8, label="spacing of the thesis")
    axis.set(xlabel="length of a gap [m]", ylabel="share in longer gaps [%]")
    sheet.finish(figure, axis, fontsize=8.5)


if __name__ == "__main__":
    main()
