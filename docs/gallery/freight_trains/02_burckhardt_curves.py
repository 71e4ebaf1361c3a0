"""Burckhardt's adhesion curves and the forces they allow: Figure 3.4, Table 3.2."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

from plant_models.railway.adhesion import BURCKHARDT_DEGRADED, BURCKHARDT_NOMINAL

WEIGHT = 90e3 * 9.81  # [N], the locomotive of chapter 3
NOT_PRINTED = "only the curve is published; an independent implementation gave the same numbers"


def main() -> None:
    """Peaks of both curves, and the curves."""
    sheet = Sheet(__file__, "Burckhardt curves, nominal and degraded", "Bouchama 2024, (3.12), Table 3.2, Figure 3.4")
    slips = np.linspace(0.0, 1.0, 500)
    figure, axis = plt.subplots(figsize=(6, 4), layout="constrained")
    for condition, curve in {"nominal": BURCKHARDT_NOMINAL, "degraded": BURCKHARDT_DEGRADED}.items():
        slip, peak = float(curve.peak_slip()), float(curve.peak())
        sheet.add(f"largest coefficient, {condition}", "1", None, peak, NOT_PRINTED)
        sheet.add(f"its slip, {condition}", "%", None, 100.0 * slip, NOT_PRINTED)
        sheet.add(f"largest force of 90 t, {condition}", "kN", None, peak * WEIGHT / 1e3, NOT_PRINTED)
        axis.plot(100.0 * slips, curve.coefficient(slips), label=condition)
        axis.plot(100.0 * slip, peak, "k.")
    axis.set(xlabel="slip (r w - v) / v [%]", ylabel="adhesion coefficient [1]")
    sheet.finish(figure, axis, fontsize=8.5)


if __name__ == "__main__":
    main()
