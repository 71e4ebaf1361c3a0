"""Optimal slip and largest adhesion over the speed, from Polach's curves: Table 4.5, Figures 3.3 and 4.38."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

from plant_models.railway.adhesion import POLACH_DRY, POLACH_WET

SPEEDS = (5, 10, 20, 30, 40, 50)  # [km/h]
TABLE_4_5 = {  # largest coefficient, optimal slip [%]
    "nominal": ((0.3894, 10.0), (0.3474, 8.0), (0.3027, 4.8), (0.2769, 4.0), (0.2594, 3.2), (0.2449, 3.2)),
    "degraded": ((0.2188, 30.4), (0.1961, 20.0), (0.1713, 14.4), (0.1566, 12.0), (0.1463, 9.6), (0.1387, 7.2)),
}
ON_A_GRID = (
    "the printed slips are multiples of 0.8 %, picked on a coarse grid of a flat maximum; ours is the "
    "continuous maximum"
)


def main() -> None:
    """Compare Table 4.5 and draw the curves."""
    sheet = Sheet(__file__, "Polach creep curves, dry and wet", "Bouchama 2024, Table 4.5, Figures 3.3 and 4.38")
    figure, axes = plt.subplots(1, 2, figsize=(10, 4), sharey=True, layout="constrained")
    slips = np.linspace(0.0, 0.6, 400)
    for axis, (condition, curve) in zip(axes, {"nominal": POLACH_DRY, "degraded": POLACH_WET}.items(), strict=True):
        for speed, (coefficient, slip) in zip(SPEEDS, TABLE_4_5[condition], strict=True):
            best_slip, best = curve.peak(speed / 3.6)
            sheet.add(f"largest coefficient, {condition}, {speed} km/h", "1", coefficient, best, ON_A_GRID)
            sheet.add(f"optimal slip, {condition}, {speed} km/h", "%", slip, 100.0 * best_slip, ON_A_GRID)
            axis.plot(100.0 * slips, curve.coefficient(slips, speed / 3.6), label=f"{speed} km/h")
            axis.plot(100.0 * best_slip, best, "k.")
        axis.set(title=f"{condition} (Table 3.1)", xlabel="slip v_g / v [%]")
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("adhesion coefficient [1]")
    axes[1].legend()
    sheet.finish(figure)


if __name__ == "__main__":
    main()
