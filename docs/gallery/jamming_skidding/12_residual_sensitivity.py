"""How a jam shows in the residual of the printed designs: over the frequency, over its length, and the smallest one."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

from fmu_observer.design.quasi_lpv_published import PUBLISHED, SECTION_5_3_1, SEEN, QuasiLpvDesign
from fmu_observer.design.residual_analysis import minimum_fault, pulse_ratio, sudden_fault
from fmu_observer.design.robust_residual import ResidualProblem, common_bands, proven_sensitivity

PULSES = {  # length [s]: ||r|| / ||f||, by an independent simulation
    "3.3.4": {0.2: 2.33, 1.0: 2.31, 2.0: 2.07, 3.0: 1.72, 5.0: 1.11},
    "5.3.1": {0.2: 3.08, 0.6: 2.61, 1.0: 2.26, 1.4: 1.98, 2.0: 1.68, 5.0: 1.02},
}
EDGES = {"3.3.4": 0.717, "5.3.1": 1.75}
NOT_HAD = (
    "over all frequencies no gamma > 0 can be had: the two integrators of the observer take a constant fault for a "
    "disturbance, so that the gain from fault to residual is zero at rest; the inequality (3.57) has no solution"
)
BAND = "gamma holds for frequencies above this edge only; the print claims it for all"
PEAK = (
    "a threshold sees the peak of the residual, which is M f at the first instant: smaller than the rule of thumb says"
)
PULSE = "none is printed; by closed integrals over all that the fault leaves behind, the independent one by simulation"


def main() -> None:
    """Sensitivities, bands, pulses and the smallest faults; the gain over the frequency."""
    sheet = Sheet(__file__, "Sensitivity of the residual to a jam", "Aguiar Cota 2019, (3.51), (3.57), 5.3.4")
    figure, axes = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
    lengths = np.geomspace(0.05, 20.0, 60)
    for design in PUBLISHED.values():
        problem = problem_of(design)
        channel = problem.fault_channels(design.gains)[0]
        section = design.section
        gamma = proven_sensitivity(problem, design.gains).proven
        sheet.add(f"{section}: gamma over all frequencies", "1", design.sensitivity, gamma, NOT_HAD, independent=0.0)
        [(edge, _)] = common_bands(problem, design.gains, design.sensitivity)
        words = f"{section}: gamma = {design.sensitivity:g} holds from"
        sheet.add(words, "rad/s", None, edge, BAND, independent=EDGES[section])
        for length, other in PULSES[section].items():
            words = f"{section}: ||r|| / ||f|| of a pulse of {length:g} s"
            sheet.add(words, "1", None, pulse_ratio(channel, length), PULSE, independent=other)
        omega = np.geomspace(1e-2, 1e2, 400)
        axes[0].loglog(omega, np.abs(channel.response(omega)[:, 0, 0]) / design.sensitivity, label=section)
        axes[1].semilogx(lengths, [pulse_ratio(channel, T) / design.sensitivity for T in lengths], label=section)
    for threshold, published, other in ((0.65, 0.28, 0.2802), (1.5, 0.64, 0.6466)):
        why = "the print cuts 0.6466 to 0.64; a rule of thumb: gamma holds neither at all frequencies nor for long jams"
        words = f"smallest fault by threshold / gamma, threshold {threshold:g}"
        sheet.add(words, "m/s", published, minimum_fault(threshold, 2.32), why, independent=other)
        words = f"smallest fault whose residual reaches {threshold:g} when it begins at once"
        channel = problem_of(SECTION_5_3_1).fault_channels(SECTION_5_3_1.gains)[0]
        sheet.add(words, "m/s", published, sudden_fault(channel, threshold), PEAK)
    axes[0].set(xlabel="frequency [rad/s]", ylabel="gain from fault to residual over gamma [1]")
    axes[1].set(xlabel="length of the jam [s]", ylabel="||r|| / ||f|| over gamma [1]")
    for axis in axes:
        axis.axhline(1.0, color="k", ls="--", lw=0.8, label="printed gamma")
    sheet.finish(figure, axes[0], grids=axes[1:])


def problem_of(design: QuasiLpvDesign) -> ResidualProblem:
    """The printed design as a question."""
    D = np.array(design.disturbance)[:, None]
    return ResidualProblem(design.vertices, SEEN, D, design.residual_gain, decay=0.0, alpha=design.alpha)


if __name__ == "__main__":
    main()
