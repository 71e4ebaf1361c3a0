"""Tables 5.4 to 5.7 in form: delays, rates and positions of the validation campaign, on synthetic data."""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "studies"))
from validation_campaign import COLUMNS, PUBLISHED, measured

SEEDS = range(6)
QUANTITIES = ("start delay", "end delay", "missed", "false", "error of the odometer", "error of the observer")
UNITS = ("s", "s", "1", "1", "30 m", "30 m")
CONFIDENTIAL = (
    "the measured runs are confidential; these are synthetic, with jams, efforts and lags that are ours, so that only "
    "the order of magnitude can agree"
)
RULES = (
    "synthetic data; the repaired rules judge at the sample, those of the thesis one sample (0.2 s) later, and at the "
    "end they wait for two samples that agree"
)
SEEDS_SAY = (
    "synthetic data, more jams than in the thesis' runs: what is missed stays below the threshold or begins with the "
    "last sample; what is called false are jams between two rows of 0.05 s, which the odometer counts and the record "
    "of the truth does not show; each is traced on the page of the campaign"
)
REASONS = (RULES, RULES, SEEDS_SAY, SEEDS_SAY, CONFIDENTIAL, CONFIDENTIAL)
MICRO = (
    "synthetic data, section 5.3.3.2 has no numbers: micro-jams are far shorter than the rows of 0.05 s, so that rates "
    "and delays of the few that a row shows count nothing; the positions are those of a slow bias"
)


def main() -> None:
    """Thirteen cases, six drawings of the jams each; published beside measured."""
    sheet = Sheet(__file__, "Validation campaign on synthetic data", "Aguiar Cota 2019, Tables 5.4 to 5.7")
    found = measured(SEEDS)
    figure, axis = plt.subplots(figsize=(7.5, 4), layout="constrained")
    for k, (case, published) in enumerate(PUBLISHED.items()):
        for i, (measure, factor) in enumerate(COLUMNS.values()):
            spread, why = found[case][measure], MICRO if "micro" in case else REASONS[i]
            if "micro" in case and np.isnan(spread.value):
                continue  # no micro-jam was found within its own time: there is no delay
            sheet.add(f"{case}: {QUANTITIES[i]}", UNITS[i], published[i], factor * spread.value, why)
        for i, colour in ((4, "tab:orange"), (5, "tab:blue")):
            measure, factor = list(COLUMNS.values())[i]
            axis.bar(k + 0.4 * (i - 4.5), factor * found[case][measure].value, 0.38, color=colour)
            if published[i] is not None:
                axis.plot(k + 0.4 * (i - 4.5), published[i], "kx")
    axis.set_xticks(range(len(PUBLISHED)), list(PUBLISHED), rotation=45, ha="right")
    axis.set(ylabel="largest error before a balise [coaches of 30 m]")
    axis.set_title("odometer (orange), observer (blue); x: published, of other jams", fontsize=9)
    sheet.finish(figure, grids=[axis])


if __name__ == "__main__":
    main()
