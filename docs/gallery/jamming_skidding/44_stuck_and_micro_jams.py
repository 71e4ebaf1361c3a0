"""What an odometer cannot tell: a wheel stuck at 90 or 110 % of the speed, and micro-jams; what balises make of it."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.jam_runs import CASES, PERIOD, Jams, at_samples, observe, odometer_error, readings, trains
from shared.sheet import Sheet

CASE, NOISE, MEMBERS = CASES["3.3.4"], 0.02, 50
OURS = (
    "ours: the thesis says that micro-jams are not detectable and give a slow bias (section 5.3.3.2), without numbers"
)
STUCK = "ours: stuck from 16 s on, 10 % too slow or too fast, 50 runs, from 17 s until 5 m/s"


def main() -> None:
    """Largest position errors, and how long a fault is told."""
    sheet = Sheet(__file__, "Stuck wheels and micro-jams", "Aguiar Cota 2019, section 5.3.3.2, Fig 5-7")
    figure, axis = plt.subplots(figsize=(6, 4), layout="constrained")
    run = trains(CASE, MEMBERS, np.random.default_rng(0))
    position, speed = at_samples(run.p), at_samples(run.v)
    t = PERIOD * np.arange(position.shape[1])
    window = (t > 17.0) & (speed.min(axis=0) > 5.0)
    low = Jams(*(np.full(MEMBERS, value) for value in (16.0, 1e3, 0.1)))
    for jams, side in ((low, "low"), (low.turned, "high")):
        stuck = readings(run, jams, NOISE, np.random.default_rng(1), True)
        for with_balises, how in ((True, "balises every 200 m"), (False, "no balises")):
            found, what = observe(CASE, run, stuck, with_balises=with_balises, noise=NOISE), f"stuck 10 % {side}, {how}"
            error = np.abs(found["position"] - position)
            reported = 100.0 * float((found["odometer_fault"][:, window] > 0.5).mean())
            sheet.add(f"{what}: fault reported", "% of the time", None, reported, STUCK, repeats=0.1)
            sheet.add(f"{what}: largest position error", "m", None, error[:, window].max(), STUCK, repeats=0.2)
            axis.plot(t[window], error[0, window], "-" if jams is low else "--", label=f"{side}, {how}")
        alone = np.abs(odometer_error(position, stuck, 200.0))
        worst = alone[:, window].max()
        sheet.add(f"stuck 10 % {side}: odometer reset at balises", "m", None, worst, STUCK, repeats=0.05)
        axis.plot(t[window], alone[0, window], ":", label=f"{side}, odometer alone")
    exact = readings(run, None, NOISE, np.random.default_rng(1), True)
    for sign, side in ((-1.0, "micro-jams"), (1.0, "micro-skids")):
        micro = exact * (1.0 + sign * 0.02 * np.clip((t - 10.0) / 10.0, 0.0, 1.0))  # 4 ms in 0.2 s, at first none
        found, what = observe(CASE, run, micro, noise=NOISE), f"{side} of 4 ms in 0.2 s"
        reported = 100.0 * float((found["odometer_fault"][:, window] > 0.5).mean())
        error = np.abs(found["position"] - position)[:, window].max()
        alone = np.abs(odometer_error(position, micro, 200.0))[:, window].max()
        sheet.add(
            f"{what}: fault reported",
            "% of the time",
            "not detectable" if sign < 0.0 else None,
            f"{reported:.0f}",
            OURS,
        )
        sheet.add(f"{what}: largest position error", "m", None, error, OURS, repeats=0.1)
        sheet.add(f"{what}: odometer reset at balises", "m", None, alone, OURS, repeats=0.1)
    axis.set(xlabel="time [s]", ylabel="position error [m]")
    axis.legend(fontsize=8)
    sheet.finish(figure)


if __name__ == "__main__":
    main()
