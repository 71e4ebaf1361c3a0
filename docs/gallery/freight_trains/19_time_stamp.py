"""What the time stamp of a balise is worth: the same telegrams at their instants, and late, at the next communication
point.
"""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

from cosim import Outcome, Scenario

STEPS = (0.01, 0.05, 0.1)  # [s]
THETAS = (2.0, 8.0)  # [1/s]
SPEED = 50.0 / 3.6  # [m/s]
WHY = (
    "not in the thesis. An independent implementation gave, late, 0.028, 0.148, 0.270 m/s rms at steps of 10, 50, 100 "
    "ms "
    "for theta = 2 1/s and 0.20, 1.21, 2.08 for 8 1/s; at the instant 0.0014 at most"
)


def run(step: float, timing: str) -> Outcome:
    """The locomotive at a constant 50 km/h for 40 s, balises at mixed gaps up to 0.5 s, one observer for each gain."""
    s = Scenario(stop=40.0, step=step, certificates="ignore")
    held = {"profile_time": [0.0] * 8, "profile_speed": [SPEED] * 8}
    s.add(
        "train",
        model="locomotive",
        preset="chapter_3_four_axles",
        parameters={"train_speed": SPEED, "wheel_rate": SPEED / 0.575},
    )
    s.add("odometer", model="odometer", parameters={"sample_period": 0.01})
    s.add("driver", model="driver", parameters=held)
    names = [f"theta_{theta:g}" for theta in THETAS]
    for name, theta in zip(names, THETAS, strict=True):
        parameters: dict[str, Any] = {"n_axles": 4, "davis_b": 32.0, "davis_c": 1.7, "theta": theta}
        s.add(name, observer="differentiator_cdo", parameters=parameters)
    s.connect(
        ", ".join(["driver.effort -> train.effort", *(f"{name}.effort" for name in names)]),
        "train.wheel_speed -> odometer.wheel_speed",
        ", ".join(["odometer.reading -> driver.odometer", *(f"{name}.odometer" for name in names)]),
    )
    s.balises(
        position="train.position",
        speed="train.speed",
        layout="aperiodic",
        min_gap=0.1,
        max_gap=0.5,
        seed=0,
        timing=timing,
    )
    return s.run(warn=lambda _warning: None)


def main() -> None:
    """Root-mean-square speed errors from 20 s on, when the start is forgotten."""
    sheet = Sheet(
        __file__, "The value of the time stamp", "not in the thesis; observer of Bouchama 2024, (3.24)-(3.43)"
    )
    figure, axes = plt.subplots(1, 2, figsize=(10, 4), sharey=True, layout="constrained")
    rms: dict[tuple[str, float], list[float]] = {}
    for timing, words in (("exact", "at its instant"), ("stale", "late")):
        for step in STEPS:
            outcome = run(step, timing)
            t, true = outcome["time"], outcome["train.speed"]
            for axis, theta in zip(axes, THETAS, strict=True):
                error = (outcome[f"theta_{theta:g}.speed"] - true)[t >= 20.0]
                value = float(np.sqrt(np.mean(error**2)))
                rms.setdefault((words, theta), []).append(value)
                name = f"rms speed error, step {1e3 * step:g} ms, theta {theta:g} 1/s, telegram {words}"
                measured = value if timing == "stale" else _small(value)
                sheet.add(name, "m/s", None, measured, WHY, repeats=0.05)
                axis.set(title=f"theta = {theta:g} 1/s", xlabel="communication step [ms]")
    for axis, theta in zip(axes, THETAS, strict=True):
        for words in ("at its instant", "late"):
            axis.loglog([1e3 * step for step in STEPS], rms[words, theta], "o-", label=f"telegram used {words}")
        axis.grid(alpha=0.3, which="both")
        axis.legend(fontsize=8)
    axes[0].set_ylabel("rms speed error, 20 to 40 s [m/s]")
    sheet.finish(figure)


def _small(value: float) -> float | str:
    """What is left at the exact instants is what differentiator and odometer leave: its size depends on rounding."""
    return value if value > 1e-3 else "< 0.001"


if __name__ == "__main__":
    main()
