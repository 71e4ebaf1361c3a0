"""Table 4.1: overshoot beta of the designs by Proposition 4-1, cells without a solution, and average bounds."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sampled_braking import W1, W2, braking
from shared.sheet import Sheet

from fmu_observer.design.proposition_4_1 import InfeasibleBounds, design_proposition_4_1, train_vertices
from fmu_observer.observers.train import DiscreteMeasurementObserver

C = (1.0, 0.0, 0.0)
TABLE = {  # m, alpha: beta, average bound e_v of the DMO; None without a solution
    (0.1, 100): (1.91, 0.59),
    (0.1, 10): (1.9, 0.44),
    (0.1, 4): (1.91, 0.38),
    (0.1, 1): (2.87, 0.91),
    (0.5, 100): (2.80, 0.86),
    (0.5, 10): (3.52, 0.82),
    (0.5, 4): None,
    (0.5, 1): None,
    (1.0, 100): (7.1, 2.2),
    (1.0, 10): None,
    (1.0, 4): None,
    (1.0, 1): None,
}
BETA = {(0.1, 100): 1.9094, (0.1, 10): 1.9094, (0.1, 4): 1.9095, (0.1, 1): 2.8692, (0.5, 100): 2.8059}
BETA |= {(0.5, 10): 3.5235, (1.0, 100): 7.1276}
AVERAGE = {(0.1, 100): 0.443, (0.1, 10): 0.419, (0.1, 4): 0.400, (0.1, 1): 0.496, (0.5, 100): 0.761}
AVERAGE |= {(0.5, 10): 0.777, (1.0, 100): 2.53}
PROFILE = (
    "ours: the brake profile u(t) of the thesis is not printed, and the average depends on it; here it is -1 m/s2, "
    "beginning at the first sample. Gains are those of the independent implementation, for where alpha is not binding "
    "they are not unique. Of (0.1, 1) the published 0.91 is not reproduced by any brake from -1 to -1.7 m/s2"
)
NEAREST = "the nearest feasible values, ours; the thesis prints a dash"


def designs(sheet: Sheet) -> None:
    """Beta, or which constraint has no solution."""
    for (m, alpha), cell in TABLE.items():
        words = f"m {m:g} 1/s, alpha {alpha:g}"
        try:
            found = design_proposition_4_1(train_vertices([W1]), C, m, alpha)
        except InfeasibleBounds as reported:
            sheet.add(f"beta, {words}", "1", "infeasible", "infeasible", independent="infeasible")
            sheet.add(f"least alpha that is feasible, {words}", "1", None, reported.nearest_alpha or 0.0, NEAREST)
            sheet.add(f"largest m that is feasible, {words}", "1/s", None, reported.nearest_m or 0.0, NEAREST)
        else:
            assert cell is not None
            sheet.add(f"beta, {words}", "1", cell[0], found.beta, independent=BETA[m, alpha])


def averages(sheet: Sheet) -> None:
    """Mean of the i-DMO bound at the end of each period, with the error of its sample known, and of the estimates."""
    observer = DiscreteMeasurementObserver()
    for (m, alpha), cell in TABLE.items():
        if cell is not None:
            bound = float(braking(observer, preset(m, alpha)).bounds.mean())
            words = f"average bound, m {m:g} 1/s, alpha {alpha:g}, brake -1 m/s2"
            sheet.add(words, "m/s", cell[1], bound, PROFILE, independent=AVERAGE[m, alpha])
    found = braking(observer, preset(0.1, 4))
    estimate, unknown = float(found.speed[1:].mean()), float(found.disturbance[1:].mean())
    sheet.add("relative error of the speed, m 0.1 1/s, alpha 4", "1", 0.04, estimate, PROFILE, independent=0.03)
    sheet.add("relative error of the disturbance, m 0.1 1/s, alpha 4", "1", 2.0, unknown, PROFILE)


def preset(m: float, alpha: float) -> str:
    return f"m_{m:g}_alpha_{alpha:g}".replace(".", "_")


def main() -> None:
    """The table, two vertices, the printed gains, and beta over the decay."""
    sheet = Sheet(__file__, "Designs by Proposition 4-1", "Aguiar Cota 2019, Proposition 4-1, Table 4.1, 4.3.4, 5.4")
    designs(sheet)
    farthest = max(
        abs(design_proposition_4_1(train_vertices([W1, W1 + W2 * 14.0]), C, *cell).beta - BETA[cell])
        for cell, known in TABLE.items()
        if known is not None
    )
    two = "not printed; two vertices, w1 + w2 v at 0 and 14 m/s, cost so much; independently at most 0.007"
    sheet.add("largest difference of beta with two vertices", "1", None, farthest, two)
    printed = design_proposition_4_1(train_vertices([W1]), C, 0.1, gains=(2.9 + W1, -5.5, -3.5))
    why = "the gain printed in 4.3.4 beside beta = 1.9 is that of m = 1 1/s, alpha = 100, and needs more"
    sheet.add("least beta of the gain of 4.3.4, m 0.1 1/s", "1", 1.9, printed.beta, why, independent=2.248)
    data = design_proposition_4_1(train_vertices([5.7e-3]), C, 0.1, 80.0, gains=(3.4057, -3.4, -1.5))
    sheet.add("least beta of the gain of 5.4, set D, m 0.1 1/s", "1", 1.9, data.beta, independent=1.90937)
    averages(sheet)
    figure, axis = plt.subplots(figsize=(6, 4), layout="constrained")
    decays = np.array([0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0])
    for alpha in (None, 100.0, 10.0, 4.0):
        found = [(m, beta) for m in decays if (beta := overshoot(float(m), alpha)) is not None]
        axis.semilogy(*np.transpose(found), "o-", ms=3, label="any gain" if alpha is None else f"alpha = {alpha:g}")
    axis.set(xlabel="decay rate m [1/s]", ylabel="least overshoot beta [1]")
    axis.grid(alpha=0.3, which="both")
    axis.legend()
    sheet.finish(figure)


def overshoot(m: float, alpha: float | None) -> float | None:
    """Least beta, or None without a solution, which is known beforehand: to find that there is none takes long."""
    if alpha is not None and m > {100.0: 1.0, 10.0: 0.59, 4.0: 0.45}[alpha]:
        return None
    return design_proposition_4_1(train_vertices([W1]), C, m, alpha).beta


if __name__ == "__main__":
    main()
