"""Tables 5.4 to 5.7 in form: delays, rates and positions of the validation campaign, on synthetic data."""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib.pyplot as plt
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
    "synthetic data, more jams than in the thesis' runs: what is missed is shorter than a sample; what is called false "
    "are jams shorter than the recorded step of 0.05 s, which the odometer counts and the record of the truth does "
    "not show"
)
REASONS = (RULES, RULES, SEEDS_SAY, SEEDS_SAY, CONFIDENTIAL, CONFIDENTIAL)


def main() -> None:
    """Twelve cases, six drawings of the jams each; published beside measured."""
    sheet = Sheet(__file__, "Validation campaign on synthetic data", "Aguiar Cota 2019, Tables 5.4 to 5.7")
    found = measured(SEEDS)
    figure, axis = plt.subplots(figsize=(7.5, 4), layout="constrained")
    for k, (case, published) in enumerate(PUBLISHED.items()):
        for i, (measure, factor) in enumerate(COLUMNS.values()):
            spread = found[case][measure]
            sheet.add(f"{case}: {QUANTITIES[i]}", UNITS[i], published[i], factor * spread.mean, REASONS[i])
        for i, colour in ((4, "tab:orange"), (5, "tab:blue")):
            measure, factor = list(COLUMNS.values())[i]
            axis.bar(k + 0.4 * (i - 4.5), factor * found[case][measure].mean, 0.38, color=colour)
            axis.plot(k + 0.4 * (i - 4.5), published[i], "kx")
    axis.set_xticks(range(len(PUBLISHED)), list(PUBLISHED), rotation=45, ha="right")
    axis.set(ylabel="largest error before a balise [coaches of 30 m]")
    axis.set_title("odometer (orange), observer (blue); x: published, of other jams", fontsize=9)
    axis.grid(alpha=0.3)
    sheet.finish(figure)


if __name__ == "__main__":
    main()
