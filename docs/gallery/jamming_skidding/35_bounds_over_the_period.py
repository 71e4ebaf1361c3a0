"""Average bounds of DMO and CDO over the sampling period, and bounds along a braking, as in Figures 4-1 to 4-5."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sampled_braking import braking
from shared.sheet import Sheet

from fmu_observer.observers.train import ContinuousDiscreteObserver, DiscreteMeasurementObserver

PERIODS = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5)  # [s]
PUBLISHED = {"m_0_1_alpha_4": 0.38, "m_0_5_alpha_100": 0.86, "m_1_alpha_100": 2.2}  # Table 4.1, 0.2 s [m/s]
DESIGNS = {"m 0.1 1/s, alpha 4": "m_0_1_alpha_4", "m 0.5 1/s, alpha 100": "m_0_5_alpha_100"}
DESIGNS |= {"m 1 1/s, alpha 100": "m_1_alpha_100"}
WHY = (
    "Figures 4-1 to 4-5 are not printed as numbers, and neither is their brake; set C, -1 m/s2 from 14 m/s down to "
    "1 m/s. The bound starts at each sample from the error that the estimate has there"
)


def main() -> None:
    """Mean bounds over the period, and two designs along the braking."""
    sheet = Sheet(__file__, "Bounds over the period", "Aguiar Cota 2019, 4.3.4, Figures 4-1 to 4-5")
    dmo, cdo = DiscreteMeasurementObserver(), ContinuousDiscreteObserver()
    figure, axes = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    apart = 0.0
    for words, name in DESIGNS.items():
        means = np.array([[braking(o, name, period).bounds.mean() for o in (dmo, cdo)] for period in PERIODS])
        apart = max(apart, float(np.abs(means[:, 1] / means[:, 0] - 1.0).max()))
        for period in (0.1, 0.2, 0.4):
            mean, printed = means[PERIODS.index(period), 0], PUBLISHED[name] if period == 0.2 else None
            sheet.add(f"average bound, {words}, period {period:g} s", "m/s", printed, mean, WHY)
        (line,) = axes[0].plot(PERIODS, means[:, 0], "o-", ms=3, label=f"DMO, {words}")
        axes[0].plot(PERIODS, means[:, 1], "k:", lw=1)
        found = braking(dmo, name)
        held = np.all(found.errors[1:] <= found.bounds[:-1])
        sheet.add(f"error at the next sample within the bound, {words}", "1", "yes", "yes" if held else "no", WHY)
        axes[1].semilogy(found.instants, found.bounds, color=line.get_color(), label=f"bound, {words}")
        axes[1].semilogy(found.instants, found.errors, color=line.get_color(), ls="--", lw=1)
    equal = "nearly" if apart < 0.05 else "no"
    sheet.add(
        "DMO and CDO have the same average bound", "1", "nearly", equal, "set C is linear: the same observer twice"
    )
    axes[0].set(xlabel="sampling period [s]", ylabel="average bound of the error [m/s]", title="dotted: CDO")
    axes[1].set(xlabel="time [s]", ylabel="bound and error at the samples [m/s]", title="period 0.2 s; dashed: error")
    for axis in axes:
        axis.grid(alpha=0.3, which="both")
        axis.legend(fontsize=8)
    sheet.finish(figure)


if __name__ == "__main__":
    main()
