"""Partial inversion with an unknown rate; Figures 4.33 to 4.36."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet
from windows import driven, recorded, rms

from fmu_observer.observers.exhibits import ReactionSignature
from plant_models.exhibits import GasPhaseReaction

AXIS = "printed without the factor 0.001 of the lost axis; -b x1^2 tau / 2 gives the same"
STARTS = ((2.5, 0.5), (1.5, 1.0), (1.0, 2.0))
TABLE = "five nodes an axis and no correction by the model, as printed: the look-up's own error decides"
CONDITION = "noise of 0.001 on y, ordinary least squares on the three unknowns"
RUN = "start, guess (2, 1) and noise are ours, the figures are lost; the first samples still carry the guess"
ILL = (
    "r1 and r2 are smallest values of nine points: noise decides which, and moves them one way; with the short window "
    "the problem is ill-conditioned too. The rate then ends at the border of its range"
)


def main() -> None:
    """r1, the search over the rate, conditioning, and runs."""
    sheet = Sheet(__file__, "Gas-phase reaction with an unknown rate", "Omar 2012, section 4.8, Figs. 4.33-4.36")
    observer = ReactionSignature(11, 6)
    p = observer.unpack_parameters(observer.start_parameters())
    for x1, published, independent in ((0.75, -0.5, -0.42), (1.5, -1.5, -1.67), (2.25, -3.5, -3.75)):
        state = np.array([[x1] * 5, np.linspace(0.0, 3.0, 5)])
        root, _ = observer.properties(state, 0.15, 0.01, 1e-2)[0]
        value = float(np.mean(-0.15 * root**2)) * 1e3
        sheet.add(f"1000 r1 at x1 = {x1}, mean over x2", "1", published, value, AXIS, independent=independent)
    costs = {}
    for x0 in STARTS:
        window = observer.properties(np.array(x0), 0.15, 0.01, 1e-2)[1]
        costs[x0] = (observer.search(window, p)[1] ** 2).sum(axis=0)
        found = float(observer.rates[np.argmin(costs[x0])])
        sheet.add(f"rate of the smallest J_r, start {x0}", "1/s", 0.15, found, "", independent=0.15)
    bare = ReactionSignature(11, 0)
    for x0 in STARTS:
        window = bare.properties(np.array(x0), 0.15, 0.01, 1e-2)[1]
        found = float(bare.rates[np.argmin((bare.search(window, p)[1] ** 2).sum(axis=0))])
        sheet.add(f"the same without correction of the table, start {x0}", "1/s", 0.15, found, TABLE)
    for period, condition, deviations in ((0.01, 8.7e3, (1.30, 1.31, 0.16)), (0.1, 197.0, (0.021, 0.022, 0.0035))):
        jacobian = sensitivity(observer, period)
        sheet.add(
            f"condition number of the window's problem, period {period} s", "1", None, np.linalg.cond(jacobian),
            "rounded there", repeats=0.02, independent=condition,
        )  # fmt: skip
        spread = 1e-3 * np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
        for name, value, other in zip(("x1", "x2", "b"), spread, deviations, strict=True):
            text = f"standard deviation of {name}, period {period} s"
            sheet.add(text, "1", None, value, CONDITION, independent=other)
    figure, axes = plt.subplots(1, 3, figsize=(12, 3.4), layout="constrained")
    for x0, values in costs.items():
        axes[0].semilogy(observer.rates, values + 1e-30, ".-", label=f"start {x0}")
    axes[0].set(xlabel="rate b [1/s]", ylabel="J_r", title="search over the rate")
    axes[0].legend(fontsize=7)
    seen = ReactionSignature()
    for axis, period in zip(axes[1:], (0.01, 0.1), strict=True):
        true = recorded(GasPhaseReaction(), 100 * period, period, sample_period=period)
        for noise in (0.0, 1e-3):
            y = true["measured_y"] + noise * np.random.default_rng(0).normal(size=len(true["time"]))
            values = seen.tabulated({"sample_period": period}) | {"sample_period": period}
            reported = driven(seen, y[:, None], estimated_x1=2.0, estimated_x2=1.0, **values)
            late = (true["time"] >= 20 * period) & (true["time"] <= 100 * period)
            for name in ("x1", "x2"):
                text = f"RMSE of {name}, q = 0.2, period {period} s, noise {noise:g}, samples 20 to 100"
                sheet.add(text, "1", None, rms(reported, true, name, late), ILL if noise else RUN)
            rate = float(np.mean(reported["rate"][late]))
            why = ILL if noise else RUN
            sheet.add(f"mean rate there, period {period} s, noise {noise:g}", "1/s", 0.15, rate, why)
            axis.plot(true["time"], reported["x1"], lw=0.9, label=f"noise {noise:g}")
        axis.plot(true["time"], true["x1"], "k--", lw=0.9, label="true")
        axis.set(xlabel="time [s]", ylabel="x1", title=f"period {period} s")
        axis.legend(fontsize=7)
    sheet.finish(figure)


def sensitivity(observer: ReactionSignature, period: float) -> np.ndarray:
    """Derivatives of the window by x1, x2 and the rate at (2.5, 0.5, 0.15), shape (11, 3)."""
    columns = []
    for i in range(3):
        sides = []
        for side in (-1e-6, 1e-6):
            at = np.array([2.5, 0.5, 0.15])
            at[i] += side
            sides.append(observer.properties(at[:2], at[2], period, 1e-2)[1])
        columns.append((sides[1] - sides[0]) / 2e-6)
    return np.stack(columns, axis=1)


main()
