"""Tables 1 to 3 and the hand-tuned row: mean square errors of the printed covariances on common noise."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from recordings import SEEDS, current_cost, of_rows
from shared.sheet import Sheet

PRINTED = {
    "hand": (0.0882, 0.0773),
    "pso_5": (0.0225, 0.0219),
    "pso_10": (0.0209, 0.0203),
    "pso_15": (0.0171, 0.0169),
    "pso_20": (0.0148, 0.0156),
    "ga_5": (0.0317, 0.0314),
    "ga_10": (0.0265, 0.0260),
    "ga_15": (0.0216, 0.0213),
    "ga_20": (0.0155, 0.0178),
    "bbo_5": (0.0188, 0.1071),
    "bbo_10": (0.0178, 0.0233),
    "bbo_15": (0.0160, 0.0166),
    "bbo_20": (0.0138, 0.0149),
}
REPAIRED = {"hand_repaired": (0.0882, 0.0887), "ga_20_repaired": (0.0155, 0.0154)}
NOISE = "mean of 10 seeds; one seed differs from the next by 5 %, and the printed run is one with an unknown seed"
ANOMALY = (
    "the printed covariances cannot give the printed error on any noise: a factor of 100 between Q and R of BBO at 5 "
    "iterations, of 10 in one entry at 10, would"
)
MISPRINT = "the row with one entry changed (r_id of hand 0.01, r_iq of GA 1.347) gives the printed error: see there"
CONJECTURE = "one entry of the printed row changed: a conjecture"
ORDER = "on common noise; where it fails PSO and BBO differ by 0.1 %"
SENSE = "printed without saying of which states; only the sum of both current errors is on scale"


def main() -> None:
    """Costs of all printed rows over ten recordings."""
    sheet = Sheet(__file__, "Printed covariances, replayed", "Allaoui 2024, section III.3.1, Tables 1-3")
    rows = [*PRINTED, *REPAIRED, "true_noise"]
    costs = np.array([current_cost(seed, of_rows(rows)) for seed in SEEDS])
    mean = dict(zip(rows, costs.mean(axis=0), strict=True))
    for row, (published, independent) in {**PRINTED, **REPAIRED}.items():
        why = ANOMALY if row in ("bbo_5", "bbo_10") else MISPRINT if row in ("hand", "ga_20") else NOISE
        why = CONJECTURE if row in REPAIRED else why
        sheet.add(
            f"MSE of both currents, {row}", "A2", published, mean[row], why, repeats=0.02, independent=independent
        )
    floor = costs[:, rows.index("true_noise")]
    sheet.add(
        "MSE with the variances of the noise itself", "A2", None, floor.mean(), SENSE, repeats=0.02, independent=0.0147
    )
    sheet.add("its smallest, 10 seeds", "A2", None, floor.min(), NOISE, repeats=0.03, independent=0.0137)
    sheet.add("its largest, 10 seeds", "A2", None, floor.max(), NOISE, repeats=0.03, independent=0.0159)
    finals = np.array([costs[:, rows.index(row)] for row in ("hand", "ga_20", "pso_20", "bbo_20")])
    held = int((np.diff(finals, axis=0) < 0.0).all(axis=0).sum())
    sheet.add("seeds on which hand > GA > PSO > BBO, of 10", "1", "single run", f"{held}", ORDER, independent="10")
    means = finals.mean(axis=1)
    sheet.add(
        "the same for the means over the seeds", "1", "yes", "yes" if (np.diff(means) < 0.0).all() else "no", ORDER
    )
    sheet.add("worst row but the anomalies, hand and GA 20: off by", "1", None, _worst(mean), NOISE, repeats=0.2)

    figure, axis = plt.subplots(figsize=(6.5, 3.5), layout="constrained")
    names = list(PRINTED)
    axis.boxplot(costs[:, : len(names)], positions=range(len(names)), widths=0.5)
    axis.plot(range(len(names)), [PRINTED[row][0] for row in names], "x", color="C3", label="printed")
    axis.axhline(floor.mean(), linestyle=":", color="C2", label="variances of the noise itself")
    axis.set(yscale="log", ylabel="MSE of both currents [A2]")
    axis.set_xticks(range(len(names)), names, rotation=60)
    axis.legend(fontsize=8)
    sheet.finish(figure)


def _worst(mean: dict[str, float]) -> float:
    clean = [row for row in PRINTED if row not in ("bbo_5", "bbo_10", "hand", "ga_20")]
    return max(abs(mean[row] / PRINTED[row][0] - 1.0) for row in clean)


if __name__ == "__main__":
    main()
