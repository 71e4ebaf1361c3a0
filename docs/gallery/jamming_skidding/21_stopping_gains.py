"""Gains of the stopping control: poles of tracking and observer, and how a lost brake shows in the residual."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

from fmu_observer import OBSERVERS
from fmu_observer.certificates.fault_cycle import FaultCycle, first_crossing
from fmu_observer.observers.train.stopping_uio import PRINTED_GAIN, observer_matrix
from plant_models.railway.control.stopping_planner import plan_stop, tracking_poles

DRAG, COLUMN = 0.1, np.array([0.1, 0.0, 0.0])
NOT_PRINTED = "not printed"


def main() -> None:
    """Poles, the residual in closed form, and what the certificate says of the sampled observer."""
    sheet = Sheet(__file__, "Gains of the stopping control", "Aguiar Cota 2019, (3.12)-(3.17), 3.2.3.1, Fig. 3-12")
    effort = plan_stop(30.0, 100.0, drag_rate=DRAG, brake_coefficient=0.1).effort
    good, printed = tracking_poles(1.4, 0.5, DRAG).real, tracking_poles(1.4, 0.5, DRAG, 1.0).real
    sheet.add("tracking, L1 = 1.4, L2 = 0.5: fast pole", "1/s", -1.0, good[0], independent=-1.0)
    sheet.add("tracking: slow pole", "1/s", -0.5, good[1], independent=-0.5)
    sign = "the plus sign printed in (3.12) contradicts the closed loop (3.14) and drives away from the reference"
    sheet.add("tracking, sign as printed: pole", "1/s", "stable", f"{printed[1]:.2f}", sign, independent="1.61")
    error = observer_matrix(DRAG) - np.outer(PRINTED_GAIN, [1.0, 0.0, 0.0])
    poles = np.sort(np.roots(np.round(np.poly(error), 9)).real)
    for pole, value in zip(poles, (-50.0, -50.0, -1.5), strict=True):
        sheet.add(f"observer, K printed: pole near {value:g}", "1/s", value, pole, independent=value)
    crossing = first_crossing(error, COLUMN, effort, 0.005)
    sheet.add("lost brake: residual above 0.005 m/s after", "s", None, crossing, independent=2.13e-3)
    lasting = FaultCycle(error, COLUMN, effort, 0.0, 0.0, 1.0, 1.0, 1.0)
    times = np.linspace(0.0, 0.3, 3001)
    residual = -np.array([lasting.error(t, np.zeros(3))[0] for t in times])
    sheet.add("its largest value", "m/s", None, np.abs(residual).max(), independent=0.0189)
    sheet.add("after", "s", None, times[np.abs(residual).argmax()], "told to the millisecond there", independent=0.019)
    sheet.add("steady error of the disturbance", "m/s2", None, lasting.steady_error[1], independent=-2.6223)
    sampled = next(OBSERVERS["stopping_uio"]().findings(10.0))
    sheet.add("sampled every millisecond, certified stable", "", None, "yes" if sampled.holds else "no", NOT_PRINTED)
    figure, axis = plt.subplots(figsize=(6, 3.6), layout="constrained")
    axis.plot(times * 1e3, np.abs(residual) * 1e3)
    for threshold, label in ((5.0, "eps1, eps2"), (1.0, "eps3")):
        axis.axhline(threshold, color="grey", ls=":", lw=0.8)
        axis.text(300.0, threshold, label, ha="right", va="bottom", fontsize=8)
    axis.set(xlabel="time since the brake was lost [ms]", ylabel="|residual| [mm/s]")
    sheet.finish(figure, grids=[axis])


if __name__ == "__main__":
    main()
