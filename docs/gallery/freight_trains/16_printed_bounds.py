"""The printed bounds of gain and gap beside the exact limits: sufficient, and 47 times too careful."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

from fmu_observer.certificates.printed_bounds.sampled_bounds import (
    lipschitz_constant,
    sampled_findings,
    smallest_theta_1_51,
    smallest_theta_3_31,
)

CHAPTER_3 = {"mass": 90e3, "davis_b": 32.0, "davis_c": 1.7}
PUBLISHED_GAP = 0.5  # [s], with theta = 8 1/s
FORMULAS = {"(1.52)": 0, "(3.32)": 1, "(3.67)": 2, "(3.87)": 1}  # and the place of their finding
MIXED, CONSTANT = 3, 4
NO_NUMBERS = (
    "the formulas are printed without numbers; an independent implementation gave 0.022 for (1.51) and 0.042 for (3.31)"
)
OWN_BOUNDS = (
    "the thesis uses gaps up to 0.5 s with theta = 8 1/s, beyond its own bounds; an independent implementation gave "
    "0.0271 "
    "and 0.0034 s for (1.52) at theta = 1 and 8 1/s, 0.0853 and 0.0107 s for (3.32)"
)
EXACT = "no exact limit is printed; independently theta times the gap: 4.00 for mixed gaps, 5.00 for constant ones"


def main() -> None:
    """Bounds at theta = 1 and 8, and all of them over theta."""
    sheet = Sheet(
        __file__, "Printed bounds beside exact limits", "Bouchama 2024, (1.51), (1.52), (3.31), (3.32), (3.67), (3.87)"
    )
    beta = {speed: lipschitz_constant(**CHAPTER_3, top_speed=speed) for speed in (50.0 / 3.6, 50.0)}
    sheet.add("smallest theta by (1.51), 50 m/s", "1/s", None, smallest_theta_1_51(beta[50.0]), NO_NUMBERS)
    sheet.add("smallest theta by (3.31), 50 km/h", "1/s", None, smallest_theta_3_31(beta[50.0 / 3.6]), NO_NUMBERS)
    thetas = (1.0, 2.0, 4.0, 8.0)
    rows = [[found.value for found in sampled_findings(theta, beta[50.0 / 3.6])] for theta in thetas]
    for theta, row in ((thetas[0], rows[0]), (thetas[-1], rows[-1])):
        published = PUBLISHED_GAP if theta == 8.0 else None
        for label, place in FORMULAS.items():
            sheet.add(f"longest gap by {label}, theta {theta:g} 1/s", "s", published, row[place], OWN_BOUNDS)
        sheet.add(f"longest mixed gaps, exact, theta {theta:g} 1/s", "s", published, row[MIXED], EXACT)
        sheet.add(f"longest constant gap, exact, theta {theta:g} 1/s", "s", None, row[CONSTANT], EXACT)
    figure, axis = plt.subplots(figsize=(6, 4), layout="constrained")
    for label in ("(1.52)", "(3.32)"):  # on those of the last the other two lie
        axis.loglog(thetas, [row[FORMULAS[label]] for row in rows], "--", label=f"printed {label}")
    axis.loglog(thetas, [row[MIXED] for row in rows], "k", label="exact, mixed gaps")
    axis.loglog(thetas, [row[CONSTANT] for row in rows], "0.6", label="exact, constant gap")
    axis.plot(8.0, PUBLISHED_GAP, "ro", label="thesis")
    axis.set(xlabel="high gain theta [1/s]", ylabel="longest gap [s]")
    axis.set_xticks(np.array(thetas), [f"{theta:g}" for theta in thetas])
    axis.grid(alpha=0.3, which="both")
    axis.legend(fontsize=8)
    sheet.finish(figure)


if __name__ == "__main__":
    main()
