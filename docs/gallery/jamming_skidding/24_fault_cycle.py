"""One fault in four phases: the error in closed form against integration, and both dwell times."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import solve_ivp
from shared.sheet import Sheet

from fmu_observer.certificates.fault_cycle import FaultCycle, overshoot
from fmu_observer.observers.train.stopping_uio import PRINTED_GAIN, observer_matrix
from plant_models.railway.control.stopping_planner import plan_stop

COLUMN = np.array([0.1, 0.0, 0.0])
START = np.array([0.01, 0.1, 0.1])
CYCLE = "the independent cycle has other instants; that the number is beyond use is what both say"
OURS = "ours, in place of (3.32)"
DIGITS = "the thesis states the formulas and no numbers"


def integrated(cycle: FaultCycle, until: float) -> np.ndarray:
    """The four phases one after the other, by SciPy."""
    e, t = START, cycle.start
    phases = ((cycle.onset, 0.0), (cycle.detection, -1.0), (cycle.end, 0.0), (cycle.recovery, 1.0), (until, 0.0))
    for end, sign in phases:
        drive = sign * COLUMN * cycle.effort
        e = solve_ivp(
            lambda _, x, d=drive: cycle.error_matrix @ x + d, (t, end), e, method="DOP853", rtol=1e-12, atol=1e-14
        ).y[:, -1]
        t = end
    return e


def main() -> None:
    """Digits of the closed forms, overshoot, and when the next fault may begin."""
    sheet = Sheet(__file__, "One fault in four phases", "Aguiar Cota 2019, (3.19)-(3.33), Fig. 3-6")
    matrix = observer_matrix(0.1) - np.outer(PRINTED_GAIN, [1.0, 0.0, 0.0])
    effort = plan_stop(30.0, 100.0, drag_rate=0.1, brake_coefficient=0.1).effort
    cycle = FaultCycle(matrix, COLUMN, effort, 0.0, 0.5, 0.503, 0.646, 0.65)
    difference = np.abs(cycle.error(1.0, START) - integrated(cycle, 1.0)).max()
    equal = "yes" if difference < 1e-9 else f"no: {difference:.0e}"
    sheet.add("(3.28) agrees with integration to 1e-9", "", None, equal, DIGITS, independent="yes")
    mapped = np.abs(cycle.over_the_cycle(START) - cycle.error(cycle.recovery, START)).max()
    sheet.add(
        "(3.33) agrees with (3.28) at t01", "", None, "yes" if mapped < 1e-12 else "no", DIGITS, independent="yes"
    )
    for decay, known in ((1.0, 34.0), (1.4, 34.25)):
        sheet.add(
            f"beta for m = {decay:g}: supremum of the norm", "1", None, overshoot(matrix, decay), independent=known
        )
    phi = float(np.linalg.norm(cycle.printed_phi()))
    sheet.add(
        "|phi u*| of the printed (3.32)", "1", None, f"1e{np.floor(np.log10(phi)):.0f}", CYCLE, independent="1e15"
    )
    sheet.add("printed dwell time", "s", None, cycle.printed_next_start(START, 1.0), CYCLE, independent=41.0)
    for decay in (1.0, 1.4):
        late = cycle.next_start(START, decay) - cycle.recovery
        sheet.add(f"usable dwell time after the recovery, m = {decay:g}", "s", None, late, OURS)
    times = np.linspace(0.0, 4.0, 1201)
    errors = np.array([cycle.error(t, START) for t in times])
    figure, axes = plt.subplots(1, 2, figsize=(9.5, 3.6), layout="constrained")
    near = (times > 0.45) & (times < 0.8)
    axes[0].plot(times[near], errors[near, 0] * 1e3)
    for instant, name in ((cycle.onset, "lost, known"), (cycle.end, "back, known")):
        axes[0].axvline(instant, color="grey", ls=":", lw=0.8)
        axes[0].text(instant, axes[0].get_ylim()[1], f" {name}", va="top", fontsize=8)
    axes[0].set(xlabel="time [s]", ylabel="error of the speed [mm/s]")
    axes[1].semilogy(times, np.linalg.norm(errors, axis=1), label="|e|")
    axes[1].axhline(np.linalg.norm(START), color="grey", lw=0.8, label="|e(t_k)|")
    axes[1].axvline(cycle.next_start(START, 1.4), color="k", ls="--", lw=0.8, label="usable dwell time, m = 1.4")
    axes[1].set(xlabel="time [s]", ylabel="size of the error")
    sheet.finish(figure, axes[1], grids=axes[:1])


if __name__ == "__main__":
    main()
