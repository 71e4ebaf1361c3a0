"""The speed error inside its bounds over a braking run with missing samples: the scenario `error_bounds`."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

from cosim import Scenario

FIGURES = (
    "the thesis shows such runs in Figs. 5-12 to 5-15, on measured data that are confidential; train and run are ours"
)
RUNNING = "a bound is no prediction: it must not be broken, and where the error comes close it is sharp"


def main() -> None:
    """Errors and bounds, held and predicted."""
    sheet = Sheet(__file__, "Error bounds over a run", "Aguiar Cota 2019, 5.4, Figs. 5-12 to 5-15")
    outcome = Scenario.load("error_bounds").run()
    if outcome.failure is not None:
        raise RuntimeError(outcome.failure)
    result = outcome.result
    time = result.time
    figure, axes = plt.subplots(2, 1, figsize=(7, 6), sharex=True, layout="constrained")
    for name, words, axis in (("dmo", "held", axes[0]), ("cdo", "predicted", axes[1])):
        error = result[f"{name}.speed"] - result["train.speed"]
        bound = result[f"{name}.error_bound"]
        moving = (time >= 3.0) & (result["train.speed"] > 1.0)
        missing = f"{words} while samples are missing"
        sheet.add(f"largest speed error, {missing}", "m/s", None, np.abs(error)[moving].max(), FIGURES)
        sheet.add(f"largest error_bound, {missing}", "m/s", None, bound[moving].max(), FIGURES)
        sheet.add(f"mean error_bound, {missing}", "m/s", None, bound[moving].mean(), FIGURES)
        share = (np.abs(error) / bound).max()
        sheet.add(f"largest share of error_bound, {missing}", "1", None, share, RUNNING)
        broken = int(np.count_nonzero(np.abs(error) > bound))
        sheet.add(f"rows that break error_bound, {missing}", "1", None, float(broken), RUNNING)
        axis.fill_between(time, -bound, bound, alpha=0.3, label="error_bound")
        axis.plot(time, result[f"{name}.carried_bound"], lw=0.8, label="carried_bound")
        axis.plot(time, result[f"{name}.error_as_printed"], "--", lw=0.8, label="error_as_printed")
        axis.plot(time, error, "k", lw=1.0, label="speed error")
        axis.set(ylabel=f"{words} [m/s]", ylim=(-4.0, 6.0))
        axis.grid(alpha=0.3)
    axes[0].legend(fontsize=8, ncols=2)
    axes[1].set_xlabel("time [s]")
    sheet.finish(figure)


if __name__ == "__main__":
    main()
