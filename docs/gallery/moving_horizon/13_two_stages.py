"""Two classifiers one after another, x and then y given x, on a synthetic electric sense; Figures 3.3 to 3.7."""

from __future__ import annotations

import electric_sense
import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

from fmu_observer.formulas.signatures.classification import PencilSpace
from fmu_observer.formulas.signatures.conditional_estimate import train_conditional

SPACE = PencilSpace((8, 12, 20), eps=(0.01, 0.1, 1.0), margin=0.02, draws=120)
WORDS = "the thesis states in words that x is told by four clouds apart; field, tank, probe and noise are ours"
LOST = "the measurements and errors of the thesis are not printed; this is a synthetic field of ours"
REACH = 1.5


def main() -> None:
    """Train at 11 positions, estimate at the 10 others."""
    sheet = Sheet(__file__, "Electric sense, synthetic: x, then y given x", "Omar 2012, section 3.5, Figs. 3.3-3.7")
    recorded, at = electric_sense.records(electric_sense.places(electric_sense.TRAINED), 1)
    estimator, margins = train_conditional(recorded, list(at[0].round(3)), list(at[1].round(3)), SPACE)
    for stage, margin in margins.items():
        sheet.add(f"narrowest strip, {stage}", "1", None, margin, WORDS)
    others, truth = electric_sense.records(electric_sense.places(electric_sense.HELD_OUT), 2)
    found = estimator.estimate(others, REACH)
    errors = 1e3 * np.abs(np.stack([found.first, found.second]) - truth)
    for i, name in enumerate("xy"):
        sheet.add(f"median error of {name}, held-out positions", "mm", None, float(np.median(errors[i])), LOST)
        sheet.add(f"its 90 % quantile, {name}", "mm", None, float(np.quantile(errors[i], 0.9)), LOST)
        within = float(np.median(errors[i][found.covered]))
        sheet.add(f"median error of {name} where covered", "mm", None, within, LOST)
    sheet.add("experiments covered, held-out positions", "%", None, float(100.0 * found.covered.mean()), LOST)
    near = truth[0] > 0.25
    words = "in words: the accuracy improves close to the walls"
    sheet.add("median error of the place, x above 0.25 m", "mm", None, median_place(errors[:, near]), words)
    sheet.add("the same, x below", "mm", None, median_place(errors[:, ~near]), words)
    figure, axes = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
    points = estimator.first.plane.points(recorded)
    for x in np.unique(at[0]):
        axes[0].plot(*points[:, at[0] == x], ".", label=f"x = {x:.2f} m")
    axes[0].plot(*estimator.first.places, "k-", lw=0.8)
    axes[0].set(xlabel="first coordinate [1]", ylabel="second coordinate [1]", title="clouds of the first stage")
    axes[0].legend(fontsize=7)
    axes[1].plot(*truth, "kx", label="held-out position")
    axes[1].plot(found.first, found.second, ".", label="estimate")
    axes[1].set(xlabel="x [m]", ylabel="y [m]", title="ten start angles each")
    axes[1].legend(fontsize=7)
    sheet.finish(figure)


def median_place(errors: np.ndarray) -> float:
    """Median of the distance between estimate and position, of errors of shape (2, n)."""
    return float(np.median(np.hypot(*errors)))


main()
