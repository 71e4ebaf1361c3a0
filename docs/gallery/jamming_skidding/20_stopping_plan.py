"""The constant brake to a mark: the example of the thesis, other speeds and distances, and where there is none."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from scipy.special import lambertw
from shared.sheet import Sheet

from plant_models.railway.control.stopping_planner import NoBrakingSolutionError, constant_brake, plan_stop

DRAG, COEFFICIENT = 0.1, 0.1
SIGN = (
    "the print has the magnitude of u* in (3.5)-(3.11) and its sign in (3.2) and in the text; ours brakes with u* < 0"
)
OURS = "ours: the thesis has one example"


def by_lambert(speed: float, distance: float) -> float:
    """u* from the closed form ``s = -W_{-1}(-c e^-c)/c - 1``, ``b U = w1 v0 / s``."""
    c = 1.0 - DRAG * distance / speed
    return -DRAG * speed / (-lambertw(-c * np.exp(-c), -1).real / c - 1.0) / COEFFICIENT


def main() -> None:
    """Numbers of the example, random cases against Lambert's function, and the efforts over the distance."""
    sheet = Sheet(__file__, "A constant brake to a mark", "Aguiar Cota 2019, (3.4)-(3.11), Algorithm 3-1, 3.2.3.1")
    plan = plan_stop(30.0, 100.0, drag_rate=DRAG, brake_coefficient=COEFFICIENT)
    sheet.add("u*, 30 m/s, 100 m", "N/kg", -26.22, plan.effort, independent=-26.2230)
    sheet.add("t_f", "s", 7.62, plan.duration, independent=7.6269)
    sheet.add("position at t_f", "m", 100.0, plan.position(plan.duration), independent=100.0)
    sheet.add(
        "c, s of ln(1 + s) = c s", "1", None, f"{1 - DRAG * 100 / 30:.4f}, {DRAG * 30 / plan.deceleration:.4f}", OURS
    )
    rng = np.random.default_rng(3)
    speeds, shares = rng.uniform(1.0, 90.0, 10_000), rng.uniform(0.05, 0.99, 10_000)
    distances = shares * speeds / DRAG
    made = -constant_brake(speeds, distances, DRAG).deceleration / COEFFICIENT
    worst = max(abs(u / by_lambert(v, d) - 1.0) for u, v, d in zip(made[:2000], speeds, distances, strict=False))
    sheet.add(
        "2000 random cases: largest difference from Lambert's function below 1e-9",
        "1",
        None,
        "yes" if worst < 1e-9 else f"no: {worst:.1e}",
        OURS,
    )
    try:
        plan_stop(8.0, 100.0, drag_rate=DRAG)
        said = "a plan"
    except NoBrakingSolutionError:
        said = "no solution: the drag stops the train after 80 m"
    sheet.add("8 m/s, 100 m: c = -0.25", "1", None, said, "the thesis does not say what happens for c <= 0")
    sheet.add("sign", "1", "U > 0 or u* < 0", "u* < 0", SIGN)
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    way = np.linspace(30.0, 400.0, 400)
    for speed in (10.0, 20.0, 30.0, 40.0):
        found = constant_brake(speed, way, DRAG)
        axes[0].semilogy(way, np.where(found.possible > 0.0, found.deceleration, np.nan), label=f"{speed:g} m/s")
        axes[0].axvline(speed / DRAG, color="grey", lw=0.5, ls=":")
    axes[0].set(xlabel="distance to the mark [m]", ylabel="deceleration by the brake [m/s2]")
    axes[0].legend(title="dotted: drag alone", fontsize=8, loc="upper right")
    times = np.linspace(0.0, plan.duration, 200)
    axes[1].plot(times, plan.speed(times), label="speed [m/s]")
    axes[1].plot(times, plan.position(times), label="position [m]")
    axes[1].set(xlabel="time [s]", title="30 m/s, 100 m")
    sheet.finish(figure, axes[1], grids=axes[:1])


if __name__ == "__main__":
    main()
