"""Gains by the repaired two-step design over the decay rate, and what the printed first step ends at."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

from fmu_observer.design.quasi_lpv_published import SECTION_3_3_4, SECTION_5_3_1, SEEN
from fmu_observer.design.robust_residual import (
    InfeasibleResidualDesign,
    ResidualProblem,
    RobustResidualDesign,
    design_robust_residual,
)

INDEPENDENT = {
    0.1: (0.138, (3.06, -1.10, -0.11)),
    0.2: (0.203, (2.78, -1.75, -0.32)),
    0.3: (0.404, (2.48, -1.90, -0.46)),
}
FAMILY = (
    "the thesis prints one design, K = [2.41, -1.34, -0.22], and no decay rate; it lies in the family and is no member "
    "of it"
)
LITERAL = (
    "the printed first step has no decay rate: the smaller it is, the smaller are lambda and the gains of both "
    "integrators, so that the best observer is one that learns no disturbance; the printed gains are not its optimum"
)
NEAREST = (
    "the printed lambda = 0.1 cannot be had with alpha = 0.2 and M = 0.3: towards no decay it falls to 0.105 only; "
    "with the printed M = 3.36 the least lambda is larger still"
)
AS_PRINTED = (
    "the first step as printed, M = 1: its optimum has next to no integrators, how little depends on the solver; the "
    "printed lambda = 0.031 and gains of 3.3.4 are no optimum of it"
)
RATES = (0.001, 0.003, 0.01, 0.03, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35)


def designed(decay: float, residual_gain: float = 0.3) -> RobustResidualDesign:
    """Set D with D = e1 and alpha = 0.2."""
    problem = ResidualProblem(
        SECTION_5_3_1.vertices, SEEN, np.eye(3)[:, :1], residual_gain, decay=decay, alpha=SECTION_5_3_1.alpha
    )
    return design_robust_residual(problem)


def main() -> None:
    """The family, its limit, and a demand that cannot be met."""
    sheet = Sheet(__file__, "Robust design over the decay rate", "Aguiar Cota 2019, Algorithm 3-2, repaired")
    family = {rate: designed(rate) for rate in RATES}
    for rate, (attenuation, gain) in INDEPENDENT.items():
        design = family[rate]
        words = f"decay {rate:g} 1/s: lambda"
        sheet.add(words, "1", None, design.attenuation, FAMILY, independent=attenuation)
        for name, value, other in zip(("v", "d", "d'"), design.gains[0, :, 0], gain, strict=True):
            sheet.add(f"decay {rate:g} 1/s: gain of {name} at rest", "SI", None, value, FAMILY, independent=other)
    slowest = family[RATES[0]]
    sheet.add("decay 0.001 1/s: lambda", "1", None, slowest.attenuation, LITERAL)
    for name, value in zip(("d", "d'"), slowest.gains[0, 1:, 0], strict=True):
        sheet.add(f"decay 0.001 1/s: gain of {name} at rest", "SI", None, value, LITERAL, repeats=0.2)
    as_printed(sheet)
    try:
        design_robust_residual(family[0.1].problem, attenuation=0.1)
    except InfeasibleResidualDesign as error:
        found = error.nearest_attenuation
        sheet.add("least lambda at decay 0.1 1/s, where 0.1 is asked", "1", 0.1, float(found or 0.0), NEAREST)
        sheet.add("alpha that 0.1 would need there", "1", 0.2, float(error.nearest_alpha or 0.0), NEAREST)
    figure, axes = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
    axes[0].loglog(RATES, [design.attenuation for design in family.values()], "o-", ms=3)
    axes[0].set(xlabel="decay rate [1/s]", ylabel="least lambda [1]")
    for i, name in enumerate(("v", "d", "d'")):
        axes[1].loglog(RATES, [abs(design.gains[0, i, 0]) for design in family.values()], "o-", ms=3, label=name)
    axes[1].set(xlabel="decay rate [1/s]", ylabel="size of the gain [SI]")
    sheet.finish(figure, axes[1], grids=axes[:1])


def as_printed(sheet: Sheet) -> None:
    """Step 1 of 3.3.4 without a decay rate."""
    D = np.array(SECTION_3_3_4.disturbance)[:, None]
    literal = design_robust_residual(ResidualProblem(SECTION_3_3_4.vertices, SEEN, D, 1.0, decay=0.0, alpha=1.0))
    found = literal.attenuation
    sheet.add("3.3.4 without decay: lambda", "1", 0.031, found, AS_PRINTED, repeats=0.05, independent=0.00799)
    printed, others, limits = (-1.216, -0.405), (-0.0394, -0.0007), (0.05, 0.001)
    parts = zip(("d", "d'"), literal.gains[0, 1:, 0], printed, others, limits, strict=True)
    for name, value, published, other, limit in parts:
        shown = f"below {limit:g}" if abs(value) < limit else f"{value:.4g}"
        sheet.add(f"3.3.4 without decay: gain of {name}", "SI", published, shown, AS_PRINTED, independent=other)


if __name__ == "__main__":
    main()
